//! Sensors, where they are and where they may not be.

use glam::DVec3;

use super::super::sensors::placed;
use super::super::{SensorFault, check_sensor};
use crate::canopy::Canopy;
use crate::inputs::{SensorInput, SensorPlaces, Sides};
use crate::options::Unit;
use crate::sensors::{MOST_SENSORS, Receives, Sensor, Shape};

fn canopy() -> Canopy {
    let mut canopy = Canopy::default();
    canopy.origin_m = DVec3::new(10.0, 20.0, -1.0);
    canopy.soil_z_m = Some(0.5);
    canopy
}

fn input(places: SensorPlaces) -> Vec<SensorInput> {
    vec![SensorInput {
        name: "s".to_owned(),
        places,
        rays: 64,
    }]
}

fn of(places: SensorPlaces) -> Vec<Sensor> {
    placed(&input(places), Unit::Centimetre, &canopy()).unwrap()
}

#[test]
fn they_stand_in_metres_from_the_local_origin_one_for_each_side_and_direction() {
    let sensors = of(SensorPlaces::Points {
        at: vec![DVec3::new(1100.0, 2200.0, 300.0)],
        normal: DVec3::new(0.0, 0.0, 2.0),
        sides: Sides::Both,
        radiance_from: vec![DVec3::new(5.0, 0.0, 0.0)],
    });
    let at = Shape::Point(DVec3::new(1.0, 2.0, 4.0));
    assert!(sensors.iter().all(|sensor| sensor.shape == at));
    let side = |facing, lower| Receives::Side { facing, lower };
    let receives: Vec<Receives> = sensors.iter().map(|sensor| sensor.receives).collect();
    let from = Receives::From(DVec3::X);
    assert_eq!(
        receives,
        [side(DVec3::Z, false), side(-DVec3::Z, true), from]
    );
}

#[test]
fn cells_of_a_grid_fill_it_row_by_row() {
    let sensors = of(SensorPlaces::Grid {
        corners: [1200.0, 2000.0, 1000.0, 2100.0],
        cells: [2, 3],
        heights: vec![0.0, 50.0],
        sides: Sides::Upper,
    });
    assert_eq!(sensors.len(), 12);
    let centres: Vec<DVec3> = sensors.iter().map(Sensor::centre_m).collect();
    assert!((centres[0] - DVec3::new(0.5, 1.0 / 6.0, 1.0)).length() < 1e-12);
    assert!((centres[1] - DVec3::new(1.5, 1.0 / 6.0, 1.0)).length() < 1e-12);
    assert!((centres[11] - DVec3::new(1.5, 5.0 / 6.0, 1.5)).length() < 1e-12);
}

#[test]
fn a_patch_faces_where_its_corners_turn_to_the_left() {
    let corners = [[0.0, 0.0], [100.0, 0.0], [100.0, 100.0], [0.0, 100.0]];
    let mut corners: Vec<DVec3> = corners.map(|[x, y]| DVec3::new(x, y, 0.0)).into();
    let up = |corners: Vec<DVec3>| {
        let sides = Sides::Upper;
        match of(SensorPlaces::Patch { corners, sides })[0].receives {
            Receives::Side { facing, .. } => facing,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(up(corners.clone()), DVec3::Z);
    corners.reverse();
    assert_eq!(up(corners), -DVec3::Z);
}

#[test]
fn what_lies_under_the_soil_and_what_is_too_much_is_refused() {
    let sphere = |z: f64| SensorPlaces::Spheres(vec![DVec3::new(0.0, 0.0, z)]);
    let place = |places| placed(&input(places), Unit::Metre, &canopy());
    // the soil is at -0.5 m
    assert!(place(sphere(-0.5)).is_ok());
    let error = place(sphere(-0.51)).unwrap_err().to_string();
    assert!(error.starts_with("sensor 's': expected a place"), "{error}");
    assert!(error.contains("at -0.5 m, found z = -0.51 m"), "{error}");
    let many = SensorPlaces::Grid {
        corners: [0.0, 0.0, 1.0, 1.0],
        cells: [u32::MAX, u32::MAX],
        heights: vec![0.0; 3],
        sides: Sides::Both,
    };
    assert!(matches!(place(many), Err(SensorFault::TooMany { found }) if found > MOST_SENSORS));
    let nowhere = Sensor {
        name: "s".to_owned(),
        shape: Shape::Point(DVec3::NAN),
        receives: Receives::Everywhere,
        rays: 64,
    };
    assert!(check_sensor(&nowhere, &canopy()).is_err());
}
