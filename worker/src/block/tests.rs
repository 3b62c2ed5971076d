use super::*;

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
        vertices_m: vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.5],
        corners: vec![0, 0, 0, 1, 2, 0],
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
        owned_soil_cells: Vec::new(),
    }
}

#[test]
fn triangles_and_elements_are_where_they_were() {
    let block = Block::new(&message()).unwrap();
    let [a, b, c, d] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.5)];
    assert_eq!(block.soup.triangles(), [[a, b, c], [c, b, d]]);
    assert_eq!(block.first, [0, 4, 5]);
    assert_eq!(block.seen_as[..10], [2, 3, 4, 5, 6, 7, 8, 9, 16, 17]);
    assert_eq!(block.solid, [true, true, true, true, false]);
    assert_eq!(block.rows, 8);
}

#[test]
fn what_is_not_there_is_refused() {
    type Spoil = fn(&mut v1::Block);
    let spoilt: [(Spoil, &str); 10] = [
        (|b| b.corners[3] = 4, "corners out of range"),
        (|b| b.corners[3] = u32::MAX, "corners out of range"),
        (|b| b.corners[3] = 0, "corners out of range"),
        (|b| b.corners[5] = 1, "4 vertices, expected 3"),
        (|b| b.corners.push(1), "7 corners, expected 6"),
        (|b| b.vertices_m.push(1.0), "13 coordinates, expected 12"),
        (|b| b.vertices_m[7] = f64::NAN, "vertices_m out of range"),
        (|b| b.runs[1].triangles = u32::MAX, "triangles in runs"),
        (
            |b| b.runs[1].skipped_elements = u32::MAX,
            "elements out of range",
        ),
        (|b| b.runs[0].divisions = 0, "divisions out of range"),
    ];
    for (spoil, expected) in spoilt {
        let mut message = message();
        spoil(&mut message);
        let fault = Block::new(&message).err().unwrap().to_string();
        assert!(fault.contains(expected), "{fault}, expected {expected}");
    }
}
