//! Sensors from where the user put them to where they are: in metres, from the local origin, one by one.

use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::canopy::Canopy;
use crate::inputs::{SensorInput, SensorPlaces, Sides};
use crate::options::Unit;
use crate::sensors::{MOST_SENSORS, RAYS, Receives, Sensor, Shape};

/// Why a sensor was refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SensorFault {
    /// It is in the dark.
    #[error(
        "sensor '{name}': expected a place that is not under the soil at {soil_z_m} m, found z = {z_m} m"
    )]
    UnderSoil {
        /// Its name.
        name: String,
        /// Of its highest point, in the user's coordinates.
        z_m: f64,
        /// In the user's coordinates.
        soil_z_m: f64,
    },
    /// Every one of them takes thousands of rays.
    #[error(
        "sensors: expected at most {MOST_SENSORS}, sides and directions counted, found {found}"
    )]
    TooMany {
        /// How many there are.
        found: usize,
    },
    /// It is no place that can be computed with.
    #[error("sensor '{name}': expected {expected}")]
    Improper {
        /// Its name.
        name: String,
        /// What it should be.
        expected: &'static str,
    },
}

/// All sensors of the inputs, in their order: points, then their sides, then their directions; of grids height by height,
/// row by row.
pub(super) fn placed(
    inputs: &[SensorInput],
    unit: Unit,
    canopy: &Canopy,
) -> Result<Vec<Sensor>, SensorFault> {
    let found = inputs.iter().map(count).fold(0, usize::saturating_add);
    if found > MOST_SENSORS {
        return Err(SensorFault::TooMany { found });
    }
    let mut sensors = Vec::with_capacity(found);
    for input in inputs {
        add(input, unit.per_metre(), &mut sensors);
    }
    for sensor in &mut sensors {
        sensor.shape = sensor.shape.moved(-canopy.origin_m);
        check_sensor(sensor, canopy)?;
    }
    Ok(sensors)
}

/// Refuses what lies under the soil, and what is nowhere.
pub fn check_sensor(sensor: &Sensor, canopy: &Canopy) -> Result<(), SensorFault> {
    let name = || sensor.name.clone();
    let improper = |expected| SensorFault::Improper {
        name: name(),
        expected,
    };
    let corners_m = sensor.shape.corners_m();
    if !corners_m.iter().all(|corner| corner.is_finite()) {
        return Err(improper("finite coordinates"));
    }
    if !RAYS.contains(&sensor.rays) {
        return Err(improper("64 to 1048576 rays"));
    }
    if let Receives::Side { facing: d, .. } | Receives::From(d) = sensor.receives
        && !d.is_normalized()
    {
        return Err(improper("a direction of a length above 0"));
    }
    let top_m = corners_m
        .iter()
        .fold(f64::NEG_INFINITY, |z, corner| z.max(corner.z));
    let origin_z_m = canopy.origin_m.z;
    match canopy.soil_z_m {
        // a height that was moved to the local origin is rounded
        Some(soil_z_m) if top_m < soil_z_m - ROUNDED * (origin_z_m.abs() + soil_z_m.abs()) => {
            Err(SensorFault::UnderSoil {
                name: name(),
                z_m: origin_z_m + top_m,
                soil_z_m: origin_z_m + soil_z_m,
            })
        }
        _ => Ok(()),
    }
}

/// What moving to an origin may round a height by, in parts of it.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

fn sides_of(sides: Sides) -> &'static [bool] {
    match sides {
        Sides::Upper => &[false],
        Sides::Lower => &[true],
        Sides::Both => &[false, true],
    }
}

/// How many sensors an input is.
fn count(input: &SensorInput) -> usize {
    match &input.places {
        SensorPlaces::Points {
            at,
            sides,
            radiance_from,
            ..
        } => at
            .len()
            .saturating_mul(sides_of(*sides).len() + radiance_from.len()),
        SensorPlaces::Patch { sides, .. } => sides_of(*sides).len(),
        SensorPlaces::Grid {
            cells,
            heights,
            sides,
            ..
        } => {
            let cells = cells
                .iter()
                .fold(1usize, |all, &n| all.saturating_mul(n as usize));
            cells
                .saturating_mul(heights.len())
                .saturating_mul(sides_of(*sides).len())
        }
        SensorPlaces::Spheres(at) => at.len(),
    }
}

fn add(input: &SensorInput, per_metre: f64, sensors: &mut Vec<Sensor>) {
    let mut push = |shape, receives| {
        sensors.push(Sensor {
            name: input.name.clone(),
            shape,
            receives,
            rays: input.rays,
        });
    };
    let side = |up: DVec3, lower: bool| Receives::Side {
        facing: if lower { -up } else { up },
        lower,
    };
    match &input.places {
        SensorPlaces::Points {
            at,
            normal,
            sides,
            radiance_from,
        } => {
            for at in at {
                let shape = Shape::Point(*at / per_metre);
                for &lower in sides_of(*sides) {
                    push(shape, side(normal.normalize(), lower));
                }
                for from in radiance_from {
                    push(shape, Receives::From(from.normalize()));
                }
            }
        }
        SensorPlaces::Patch { corners, sides } => {
            let corners_m: Vec<DVec3> = corners.iter().map(|&corner| corner / per_metre).collect();
            let (first, last) = (corners_m[0], corners_m[corners_m.len() - 1]);
            let edges = [corners_m[1] - first, last - first];
            let shape = if corners_m.len() == 3 {
                Shape::Triangle(first, edges)
            } else {
                Shape::Parallelogram(first, edges)
            };
            let up = edges[0].cross(edges[1]).normalize();
            for &lower in sides_of(*sides) {
                push(shape, side(up, lower));
            }
        }
        SensorPlaces::Grid {
            corners: [x0, y0, x1, y1],
            cells,
            heights,
            sides,
        } => {
            let (a, b) = (DVec2::new(*x0, *y0), DVec2::new(*x1, *y1));
            let (min, max) = (a.min(b) / per_metre, a.max(b) / per_metre);
            let cell = (max - min) / DVec2::new(f64::from(cells[0]), f64::from(cells[1]));
            let edges = [DVec3::X * cell.x, DVec3::Y * cell.y];
            for z in heights {
                for k in 0..cells[0] * cells[1] {
                    let place = DVec2::new(f64::from(k % cells[0]), f64::from(k / cells[0]));
                    let corner = (min + place * cell).extend(z / per_metre);
                    for &lower in sides_of(*sides) {
                        push(Shape::Parallelogram(corner, edges), side(DVec3::Z, lower));
                    }
                }
            }
        }
        SensorPlaces::Spheres(at) => {
            for at in at {
                push(Shape::Point(*at / per_metre), Receives::Everywhere);
            }
        }
    }
}
