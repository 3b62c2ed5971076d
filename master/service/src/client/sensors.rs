//! Sensors as a master takes them.

use std::collections::HashMap;

use glam::DVec3;
use nestrad_common::sensors::{Receives, Sensor, Shape};
use nestrad_proto::v1;
use v1::sensor::Receives as Sent;

/// All sensors of a scene; nothing where there are none.
pub(super) fn list(sensors: &[Sensor]) -> Option<v1::SensorList> {
    let mut list = v1::SensorList::default();
    let mut known: HashMap<&str, u32> = HashMap::new();
    for sensor in sensors {
        let next = list.names.len() as u32;
        let name = *known.entry(&sensor.name).or_insert(next);
        if name == next {
            list.names.push(sensor.name.clone());
        }
        let (at, edges, triangle) = match sensor.shape {
            Shape::Point(at) => (at, None, false),
            Shape::Triangle(at, edges) => (at, Some(edges), true),
            Shape::Parallelogram(at, edges) => (at, Some(edges), false),
        };
        list.sensors.push(v1::Sensor {
            name,
            at_m: Some(vector(at)),
            first_edge_m: edges.map(|[edge, _]| vector(edge)),
            second_edge_m: edges.map(|[_, edge]| vector(edge)),
            triangle,
            receives: Some(match sensor.receives {
                Receives::Side { facing, lower } => Sent::Side(v1::SensorSide {
                    facing: Some(vector(facing)),
                    lower,
                }),
                Receives::Everywhere => Sent::Everywhere(v1::sensor::Everywhere {}),
                Receives::From(from) => Sent::From(vector(from)),
            }),
            rays: Some(sensor.rays),
        });
    }
    (!sensors.is_empty()).then_some(list)
}

fn vector(DVec3 { x, y, z }: DVec3) -> v1::Vector {
    v1::Vector { x, y, z }
}
