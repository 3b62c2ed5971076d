use super::*;

const LAST: DVec3 = DVec3::new(1.0, 1.0, 0.5);
const TRIANGLES: [[DVec3; 3]; 2] = [
    [DVec3::ZERO, DVec3::X, DVec3::Y],
    [DVec3::Y, DVec3::X, LAST],
];

fn message() -> v1::Block {
    let vector = |x, y, z| Some(v1::Vector { x, y, z });
    v1::Block {
        world: Some(v1::World {
            min_m: vector(0.0, 0.0, 0.0),
            max_m: vector(1.0, 1.0, 1.0),
            elements: 9,
            sphere_radius_m: f64::INFINITY,
            ..v1::World::default()
        }),
        mesh: Some(mesh::pack(
            TRIANGLES.map(|t| t.map(|c| c.to_array())).into_iter(),
        )),
        runs: vec![
            v1::TriangleRun {
                triangles: 1,
                skipped_elements: 1,
                divisions: 2,
                owned: true,
                solid: true,
            },
            v1::TriangleRun {
                triangles: 1,
                skipped_elements: 3,
                divisions: 1,
                ..v1::TriangleRun::default()
            },
        ],
        owned_soil: Vec::new(),
    }
}

#[test]
fn triangles_and_elements_are_where_they_were() {
    let block = Block::new(&message()).unwrap();
    assert_eq!(block.soup.triangles(), TRIANGLES);
    assert_eq!(block.first, [0, 4, 5]);
    assert_eq!(block.divisions, [2, 1]);
    assert_eq!(block.solid, [true, true, true, true, false]);
    assert_eq!(block.rows(), 8);
    let numbers: Vec<u32> = (0..10).map(|local| block.number_of(local)).collect();
    assert_eq!(numbers, [2, 3, 4, 5, 6, 7, 8, 9, 16, 17]);
    let rows: Vec<Option<u32>> = (0..10).map(|local| block.row_of(local)).collect();
    let expected: Vec<Option<u32>> = (0..8).map(Some).chain([None, None]).collect();
    assert_eq!(rows, expected);
}

#[test]
fn a_whole_scene_is_numbered_as_its_parts_are() {
    let mut message = message();
    for run in &mut message.runs {
        (run.owned, run.skipped_elements) = (true, 0);
    }
    if let Some(world) = &mut message.world {
        world.elements = 5;
        world.soil = Some(v1::SoilPlane {
            cell_x_m: 0.5,
            cell_y_m: 1.0,
            cells_x: 2,
            cells_y: 1,
            ..v1::SoilPlane::default()
        });
    }
    let cells = |cells| v1::CellRun {
        cells,
        skipped_cells: 0,
    };
    message.owned_soil = vec![cells(1), cells(1)];
    let whole = Block::new(&message).unwrap();
    message.owned_soil.pop();
    let part = Block::new(&message).unwrap();
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
    type Spoil = fn(&mut v1::Block);
    let spoilt: [(Spoil, &str); 7] = [
        (|b| b.mesh = None, "without mesh"),
        (
            |b| b.mesh = Some(v1::Mesh::default()),
            "x_m of the mesh cannot be unpacked",
        ),
        (|b| b.runs[1].triangles = u32::MAX, "triangles in runs"),
        (
            |b| b.runs[1].skipped_elements = u32::MAX,
            "elements out of range",
        ),
        (|b| b.runs[0].divisions = 0, "divisions out of range"),
        (|b| b.runs[0].divisions = u32::MAX, "divisions out of range"),
        (
            |b| {
                b.owned_soil.push(v1::CellRun {
                    cells: 1,
                    skipped_cells: 0,
                })
            },
            "owned_soil out of range",
        ),
    ];
    for (spoil, expected) in spoilt {
        let mut message = message();
        spoil(&mut message);
        let fault = Block::new(&message).err().unwrap().to_string();
        assert!(fault.contains(expected), "{fault}, expected {expected}");
    }
}
