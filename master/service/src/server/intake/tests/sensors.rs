//! Sensors of a client.

use glam::DVec3;
use nestrad_common::sensors::{MOST_SENSORS, Receives, Shape};

use super::super::sensors;
use super::*;

fn canopy() -> Canopy {
    let mut canopy = Canopy::default();
    canopy.origin_m = DVec3::new(1.0, 2.0, 3.0);
    canopy.soil_z_m = Some(0.0);
    canopy
}

fn vector(x: f64, y: f64, z: f64) -> v1::Vector {
    v1::Vector { x, y, z }
}

/// The upper side of a triangle.
fn triangle() -> v1::Sensor {
    v1::Sensor {
        name: 0,
        at_m: Some(vector(1.0, 2.0, 4.0)),
        first_edge_m: Some(vector(1.0, 0.0, 0.0)),
        second_edge_m: Some(vector(0.0, 1.0, 0.0)),
        triangle: true,
        receives: Some(v1::sensor::Receives::Side(v1::SensorSide {
            facing: Some(vector(0.0, 0.0, 2.0)),
            lower: false,
        })),
        rays: None,
    }
}

fn list(sensors: Vec<v1::Sensor>) -> Option<v1::SensorList> {
    let names = vec!["bench".to_owned()];
    Some(v1::SensorList { names, sensors })
}

#[test]
fn a_sensor_stands_where_the_vertices_do() {
    assert_eq!(sensors(None, &canopy()), Ok([].into()));
    let known = sensors(list(vec![triangle()]), &canopy()).unwrap();
    let edges = [DVec3::X, DVec3::Y];
    assert_eq!(known[0].shape, Shape::Triangle(DVec3::Z, edges));
    let up = Receives::Side {
        facing: DVec3::Z,
        lower: false,
    };
    assert_eq!((known[0].receives, known[0].rays), (up, 4096));
    assert_eq!(known[0].name, "bench");
}

#[test]
fn what_cannot_be_is_refused_by_its_field() {
    let with = |change: fn(&mut v1::Sensor)| {
        let mut sensor = triangle();
        change(&mut sensor);
        refusal(sensors(list(vec![triangle(), sensor]), &canopy()))
    };
    for (message, said) in [
        (
            with(|s| s.name = 1),
            "sensors.sensors[1].name: expected a number",
        ),
        (
            with(|s| s.at_m = None),
            "sensors.sensors[1].at_m: expected a place",
        ),
        (
            with(|s| s.first_edge_m = None),
            "second_edge_m: expected two edges or none",
        ),
        (
            with(|s| s.second_edge_m = s.first_edge_m),
            "second_edge_m: expected an edge that makes a surface",
        ),
        (with(|s| s.receives = None), "receives: expected one of"),
        (
            with(|s| s.receives = Some(v1::sensor::Receives::Side(v1::SensorSide::default()))),
            "side.facing: expected a direction",
        ),
        (
            with(|s| s.receives = Some(v1::sensor::Receives::From(vector(1.0, 0.0, 0.0)))),
            "from: expected radiance of a point",
        ),
        (
            with(|s| s.rays = Some(1)),
            "sensors.sensors[1]: sensor 'bench': expected 64 to",
        ),
        (
            with(|s| s.at_m = Some(vector(f64::NAN, 0.0, 0.0))),
            "sensor 'bench': expected finite coordinates",
        ),
        (
            with(|s| s.at_m = Some(vector(0.0, 0.0, 2.0))),
            "expected a place that is not under the soil",
        ),
    ] {
        assert!(message.contains(said), "{said}: {message}");
    }
    let many = list(vec![triangle(); MOST_SENSORS + 1]);
    let message = refusal(sensors(many, &canopy()));
    assert!(
        message.contains("sensors.sensors: expected at most"),
        "{message}"
    );
    let unnamed = v1::SensorList {
        names: vec![String::new()],
        sensors: vec![triangle()],
    };
    let message = refusal(sensors(Some(unnamed), &canopy()));
    assert!(
        message.contains("sensors.names[0]: expected 1 to 255 bytes"),
        "{message}"
    );
}
