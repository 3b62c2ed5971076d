//! `[[sensors]]`: where light is to be measured besides.
//!
//! ```toml
//! [[sensors]]
//! name = "top"
//! points = [[0.4, 0.3, 1.2], [0.4, 0.3, 0.6]]     # in the unit of the geometry, z up
//! normal = [0, 0, 1]                              # of all of them; up where it is not given
//! sides = "both"                                  # "upper" (default), "lower" or "both"
//! radiance_from = [[1, 0, 0], [-1, 0, 0]]         # from a point to where it looks: radiance too
//! rays = 4096                                     # of each point and side; more is finer
//!
//! [[sensors]]
//! name = "bench"
//! patch = [[0, 0, 0.8], [1, 0, 0.8], [1, 2, 0.8], [0, 2, 0.8]]     # or three corners
//!
//! [[sensors]]
//! name = "floor"
//! grid = { corners = [0, 0, 1.5, 0.75], cells = [30, 15], heights = [0, 0.5] }
//!
//! [[sensors]]
//! name = "bud"
//! spheres = [[0.4, 0.3, 0.9]]                     # scalar irradiance
//! ```

use glam::DVec3;
use toml::Spanned;

use super::super::error::FormatError;
use super::Text;
use super::tables::{GridTable, SensorTable};
use crate::formats::MAX_COORDINATE;
use crate::inputs::{SensorInput, SensorPlaces};
use crate::sensors::{DEFAULT_RAYS, MAX_SENSOR_NAME_BYTES, RAYS};

/// What all tables say, checked; names differ.
pub(super) fn inputs(
    tables: Vec<Spanned<SensorTable>>,
    text: &Text<'_>,
) -> Result<Vec<SensorInput>, FormatError> {
    let mut inputs: Vec<SensorInput> = Vec::with_capacity(tables.len());
    for table in tables {
        let span = table.span();
        let refused = |Fault { expected, found }| text.fault(&span, expected, found);
        let input = input(table.into_inner()).map_err(refused)?;
        if inputs.iter().any(|other| other.name == input.name) {
            let expected = "a name of its own for each of [[sensors]]";
            return Err(text.fault(&span, expected, format_args!("'{}' again", input.name)));
        }
        inputs.push(input);
    }
    Ok(inputs)
}

/// What was expected of which key, and what was found.
struct Fault {
    expected: String,
    found: String,
}

fn input(table: SensorTable) -> Result<SensorInput, Fault> {
    let SensorTable {
        name,
        points,
        patch,
        grid,
        spheres,
        normal,
        sides,
        radiance_from,
        rays,
    } = table;
    let fault = |expected: &str, found: String| Fault {
        expected: format!(
            "{expected} of sensor '{}'",
            name.chars().take(40).collect::<String>()
        ),
        found,
    };
    if !(1..=MAX_SENSOR_NAME_BYTES).contains(&name.len()) {
        let expected = format!("a name of 1 to {MAX_SENSOR_NAME_BYTES} bytes");
        return Err(fault(&expected, format!("{} bytes", name.len())));
    }
    let rays = rays.unwrap_or(DEFAULT_RAYS);
    if !RAYS.contains(&rays) {
        let expected = format!("rays: {} to {}", RAYS.start(), RAYS.end());
        return Err(fault(&expected, rays.to_string()));
    }
    let is_place = |x: f64| x.is_finite() && x.abs() <= MAX_COORDINATE;
    let places_of = |key: &str, given: Vec<[f64; 3]>| match given {
        list if list.is_empty() => Err(fault(&format!("{key}: at least one"), "none".into())),
        list => match list.iter().find(|at| !at.iter().all(|&x| is_place(x))) {
            Some(at) => {
                let expected = format!("{key}: coordinates within {MAX_COORDINATE:e} of zero");
                Err(fault(&expected, format!("{at:?}")))
            }
            None => Ok(list.into_iter().map(DVec3::from_array).collect::<Vec<_>>()),
        },
    };
    let directions_of = |key: &str, given: Vec<[f64; 3]>| {
        let list = places_of(key, given)?;
        match list.iter().find(|d| d.try_normalize().is_none()) {
            Some(d) => {
                let expected = format!("{key}: a direction of a length above 0");
                Err(fault(&expected, d.to_string()))
            }
            None => Ok(list),
        }
    };
    if points.is_none() {
        for (key, is_given) in [
            ("normal", normal.is_some()),
            ("radiance_from", radiance_from.is_some()),
        ] {
            if is_given {
                return Err(fault(
                    "points where there is a normal or radiance_from",
                    key.into(),
                ));
            }
        }
    }
    let places = match (points, patch, grid, spheres) {
        (Some(points), None, None, None) => SensorPlaces::Points {
            at: places_of("points", points)?,
            normal: directions_of("normal", vec![normal.unwrap_or([0.0, 0.0, 1.0])])?[0],
            sides: sides.unwrap_or_default(),
            radiance_from: match radiance_from {
                Some(list) => directions_of("radiance_from", list)?,
                None => Vec::new(),
            },
        },
        (None, Some(patch), None, None) => {
            let corners = places_of("patch", patch)?;
            check_patch(&corners).map_err(|found| {
                let expected =
                    "patch: the three corners of a triangle, or the four of a parallelogram in order, with an area";
                fault(expected, found)
            })?;
            SensorPlaces::Patch {
                corners,
                sides: sides.unwrap_or_default(),
            }
        }
        (
            None,
            None,
            Some(GridTable {
                corners,
                cells,
                heights,
            }),
            None,
        ) => {
            let [x0, y0, x1, y1] = corners;
            if !corners.iter().all(|&x| is_place(x)) || x0 == x1 || y0 == y1 {
                let expected = "grid.corners: x, y of two opposite corners";
                return Err(fault(expected, format!("{corners:?}")));
            }
            if cells.contains(&0) {
                return Err(fault(
                    "grid.cells: 1 or more along x and y",
                    format!("{cells:?}"),
                ));
            }
            if heights.is_empty() || !heights.iter().all(|&z| is_place(z)) {
                return Err(fault("grid.heights: one or more", format!("{heights:?}")));
            }
            SensorPlaces::Grid {
                corners,
                cells,
                heights,
                sides: sides.unwrap_or_default(),
            }
        }
        (None, None, None, Some(spheres)) => {
            if sides.is_some() {
                return Err(fault("spheres without sides", "sides".into()));
            }
            SensorPlaces::Spheres(places_of("spheres", spheres)?)
        }
        _ => {
            let expected = "one of points, patch, grid and spheres";
            return Err(fault(expected, "none or several".into()));
        }
    };
    Ok(SensorInput { name, places, rays })
}

/// How far the fourth corner of a parallelogram may be off, in parts of its diagonals.
const SKEW: f64 = 1e-6;

fn check_patch(corners: &[DVec3]) -> Result<(), String> {
    let has_area = |a: DVec3, b: DVec3| a.cross(b).try_normalize().is_some();
    let proper = match *corners {
        [a, b, c] => has_area(b - a, c - a),
        [a, b, c, d] => {
            let off = (a + c - b - d).length();
            has_area(b - a, d - a) && off <= SKEW * ((c - a).length() + (d - b).length())
        }
        _ => false,
    };
    if proper {
        return Ok(());
    }
    let corners: Vec<String> = corners.iter().map(DVec3::to_string).collect();
    Err(corners.join(", "))
}

#[cfg(test)]
#[path = "sensors_tests.rs"]
mod tests;
