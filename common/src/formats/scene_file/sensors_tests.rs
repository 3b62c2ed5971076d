//! What `[[sensors]]` may say.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use glam::DVec3;

use super::super::parse;
use crate::inputs::{SensorPlaces, Sides};

fn parsed(text: &str) -> Vec<crate::inputs::SensorInput> {
    parse("a.toml", text.as_bytes(), Path::new("dir"))
        .unwrap()
        .sensors
}

fn refusal(table: &str) -> String {
    let text = format!("[[sensors]]\n{table}\n");
    parse("a.toml", text.as_bytes(), Path::new("dir"))
        .unwrap_err()
        .to_string()
}

#[test]
fn all_kinds_of_places_are_read() {
    let sensors = parsed(
        r#"
[[sensors]]
name = "top"
points = [[0.4, 0.3, 1.2], [1, 2, 3]]
normal = [0, 1, 0]
sides = "both"
radiance_from = [[1, 0, 0]]
rays = 1000
[[sensors]]
name = "bench"
patch = [[0, 0, 0.8], [1, 0, 0.8], [1, 2, 0.8], [0, 2, 0.8]]
sides = "lower"
[[sensors]]
name = "floor"
grid = { corners = [0, 0, 1.5, 0.75], cells = [30, 15], heights = [0, 0.5] }
[[sensors]]
name = "bud"
spheres = [[0.4, 0.3, 0.9]]
"#,
    );
    let names: Vec<&str> = sensors.iter().map(|sensor| sensor.name.as_str()).collect();
    assert_eq!(names, ["top", "bench", "floor", "bud"]);
    let rays: Vec<u32> = sensors.iter().map(|sensor| sensor.rays).collect();
    assert_eq!(rays, [1000, 4096, 4096, 4096]);
    let SensorPlaces::Points {
        at,
        normal,
        sides,
        radiance_from,
    } = &sensors[0].places
    else {
        panic!("{:?}", sensors[0]);
    };
    assert_eq!((at.len(), *sides), (2, Sides::Both));
    assert_eq!((*normal, &radiance_from[..]), (DVec3::Y, &[DVec3::X][..]));
    assert!(matches!(
        &sensors[1].places,
        SensorPlaces::Patch { corners, sides: Sides::Lower } if corners.len() == 4
    ));
    assert!(matches!(
        &sensors[2].places,
        SensorPlaces::Grid { cells: [30, 15], heights, sides: Sides::Upper, .. } if heights.len() == 2
    ));
    assert!(matches!(&sensors[3].places, SensorPlaces::Spheres(at) if at.len() == 1));
}

#[test]
fn what_cannot_be_is_refused_by_its_key() {
    for (table, expected) in [
        ("points = [[0, 0, 0]]", "missing field `name`"),
        (
            "name = ''\npoints = [[0, 0, 0]]",
            "expected a name of 1 to 255 bytes",
        ),
        (
            "name = 's'",
            "expected one of points, patch, grid and spheres of sensor 's'",
        ),
        (
            "name = 's'\npoints = [[0, 0, 0]]\nspheres = [[0, 0, 0]]",
            "expected one of points, patch, grid and spheres",
        ),
        (
            "name = 's'\npoints = []",
            "points: at least one of sensor 's'",
        ),
        (
            "name = 's'\npoints = [[0, 0, inf]]",
            "points: coordinates within 1e12 of zero",
        ),
        ("name = 's'\npoints = [[0, 0]]", "expected"),
        (
            "name = 's'\npoints = [[0, 0, 0]]\nnormal = [0, 0, 0]",
            "normal: a direction of a length above 0",
        ),
        (
            "name = 's'\npoints = [[0, 0, 0]]\nradiance_from = [[0, 0, 0]]",
            "radiance_from: a direction of a length above 0",
        ),
        (
            "name = 's'\nspheres = [[0, 0, 0]]\nnormal = [0, 0, 1]",
            "points where there is a normal or radiance_from",
        ),
        (
            "name = 's'\nspheres = [[0, 0, 0]]\nsides = 'both'",
            "spheres without sides",
        ),
        (
            "name = 's'\npoints = [[0, 0, 0]]\nsides = 'left'",
            "unknown variant `left`",
        ),
        (
            "name = 's'\npoints = [[0, 0, 0]]\nrays = 10",
            "rays: 64 to 1048576 of sensor 's'",
        ),
        (
            "name = 's'\npatch = [[0, 0, 0], [1, 0, 0]]",
            "patch: the three corners",
        ),
        (
            "name = 's'\npatch = [[0, 0, 0], [1, 0, 0], [2, 0, 0]]",
            "patch: the three corners",
        ),
        (
            "name = 's'\npatch = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]]",
            "the four of a parallelogram",
        ),
        (
            "name = 's'\ngrid = { corners = [0, 0, 0, 1], cells = [1, 1], heights = [0] }",
            "grid.corners: x, y of two opposite corners",
        ),
        (
            "name = 's'\ngrid = { corners = [0, 0, 1, 1], cells = [1, 0], heights = [0] }",
            "grid.cells: 1 or more",
        ),
        (
            "name = 's'\ngrid = { corners = [0, 0, 1, 1], cells = [1, 1], heights = [] }",
            "grid.heights: one or more",
        ),
        ("name = 's'\npoint = [[0, 0, 0]]", "unknown field `point`"),
        (
            "name = 's'\nspheres = [[0, 0, 0]]\n[[sensors]]\nname = 's'\nspheres = [[0, 0, 1]]",
            "expected a name of its own for each of [[sensors]], found 's' again",
        ),
    ] {
        let message = refusal(table);
        assert!(message.starts_with("a.toml, line "), "{table}: {message}");
        assert!(message.contains(expected), "{table}: {message}");
    }
}
