use glam::DVec2;

use super::*;

const LAST: DVec3 = DVec3::new(1.0, 1.0, 0.5);
const TRIANGLES: [[DVec3; 3]; 2] = [
    [DVec3::ZERO, DVec3::X, DVec3::Y],
    [DVec3::Y, DVec3::X, LAST],
];

fn frame() -> BlockFrame {
    BlockFrame {
        world: World {
            extent: Extent {
                min_m: DVec3::ZERO,
                max_m: DVec3::ONE,
                periodic: false,
            },
            elements: 9,
            soil: None,
            radius_m: f64::INFINITY,
            far: None,
        },
        runs: vec![
            TriangleRun {
                triangles: 1,
                skipped_elements: 1,
                divisions: 2,
                owned: true,
                solid: true,
            },
            TriangleRun {
                triangles: 1,
                skipped_elements: 3,
                divisions: 1,
                ..TriangleRun::default()
            },
        ],
        owned_soil: Vec::new(),
    }
}

fn block(frame: &BlockFrame) -> Result<Block, BlockFault> {
    Block::new(frame, Arc::new(TRIANGLES.into_iter().collect()))
}

#[test]
fn triangles_and_elements_are_where_they_were() {
    let block = block(&frame()).unwrap();
    assert!(block.soup.triangles().eq(TRIANGLES));
    assert_eq!(block.elements.first, [0, 4, 5]);
    assert_eq!(block.elements.divisions, [2, 1]);
    assert_eq!(block.flags.solid, [true, true, true, true, false]);
    assert_eq!(block.rows(), 8);
    let numbers: Vec<u32> = (0..10).map(|local| block.number_of(local)).collect();
    assert_eq!(numbers, [2, 3, 4, 5, 6, 7, 8, 9, 16, 17]);
    let rows: Vec<Option<u32>> = (0..10).map(|local| block.row_of(local)).collect();
    let expected: Vec<Option<u32>> = (0..8).map(Some).chain([None, None]).collect();
    assert_eq!(rows, expected);
}

#[test]
fn a_whole_scene_is_numbered_as_its_parts_are() {
    let mut frame = frame();
    for run in &mut frame.runs {
        (run.owned, run.skipped_elements) = (true, 0);
    }
    frame.world.elements = 5;
    frame.world.soil = Some(SoilGrid {
        z_m: 0.0,
        min_m: DVec2::ZERO,
        cell_m: DVec2::new(0.5, 1.0),
        cells: [2, 1],
    });
    let cells = |cells| CellRun {
        cells,
        skipped_cells: 0,
    };
    frame.owned_soil = vec![cells(1), cells(1)];
    let whole = block(&frame).unwrap();
    frame.owned_soil.pop();
    let part = block(&frame).unwrap();
    assert_eq!((whole.rows(), part.rows()), (12, 11));
    assert_eq!(whole.local_ends(), part.local_ends());
    for local in 0..whole.local_ends() {
        assert_eq!(whole.number_of(local), part.number_of(local));
        // the second cell has no row in the part
        let row = whole.row_of(local).filter(|_| local != 11);
        assert_eq!(part.row_of(local), row, "{local}");
    }
}

#[test]
fn what_is_not_there_is_refused() {
    type Spoil = fn(&mut BlockFrame);
    let spoilt: [(Spoil, &str); 8] = [
        (|b| b.runs[1].triangles = u32::MAX, "triangles in runs"),
        (
            |b| b.runs[1].skipped_elements = u32::MAX,
            "elements out of range",
        ),
        (|b| b.runs[0].divisions = 0, "divisions out of range"),
        (|b| b.runs[0].divisions = u32::MAX, "divisions out of range"),
        (
            |b| {
                b.owned_soil.push(CellRun {
                    cells: 1,
                    skipped_cells: 0,
                })
            },
            "owned_soil out of range",
        ),
        (|b| b.world.extent.max_m.x = f64::NAN, "extent out of range"),
        (
            |b| b.world.radius_m = f64::NAN,
            "sphere_radius_m out of range",
        ),
        (|b| b.world.elements = u32::MAX, "elements out of range"),
    ];
    for (spoil, expected) in spoilt {
        let mut frame = frame();
        spoil(&mut frame);
        let fault = block(&frame).err().unwrap().to_string();
        assert!(fault.contains(expected), "{fault}, expected {expected}");
    }
}
