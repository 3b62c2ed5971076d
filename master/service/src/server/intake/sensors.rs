//! Sensors that a client asks for.

use std::sync::Arc;

use glam::DVec3;
use nestrad_common::assemble::check_sensor;
use nestrad_common::canopy::Canopy;
use nestrad_common::sensors::{
    DEFAULT_RAYS, MAX_SENSOR_NAME_BYTES, MOST_SENSORS, Receives, Sensor, Shape,
};
use nestrad_proto::v1;
use v1::sensor::Receives as Sent;

use super::super::error::{ErrorCode, ServiceError};

/// The sensors of a solve of a canopy, checked as files are checked.
pub(in crate::server) fn sensors(
    given: Option<v1::SensorList>,
    canopy: &Canopy,
) -> Result<Arc<[Sensor]>, ServiceError> {
    let v1::SensorList { names, sensors } = given.unwrap_or_default();
    if sensors.len() > MOST_SENSORS {
        let wanted = format_args!("at most {MOST_SENSORS}");
        return Err(ServiceError::invalid(
            "sensors.sensors",
            wanted,
            sensors.len(),
        ));
    }
    for (index, name) in names.iter().enumerate() {
        if !(1..=MAX_SENSOR_NAME_BYTES).contains(&name.len()) {
            let place = format_args!("sensors.names[{index}]");
            let wanted = format_args!("1 to {MAX_SENSOR_NAME_BYTES} bytes");
            return Err(ServiceError::invalid(place, wanted, name.len()));
        }
    }
    let checked = sensors.iter().enumerate().map(|(index, given)| {
        let sensor = sensor(index, given, &names)?;
        let sensor = Sensor {
            shape: sensor.shape.moved(-canopy.origin_m),
            ..sensor
        };
        check_sensor(&sensor, canopy).map_err(|fault| {
            let message = format!("sensors.sensors[{index}]: {fault}");
            ServiceError::new(ErrorCode::Invalid, message)
        })?;
        Ok(sensor)
    });
    checked.collect()
}

fn sensor(index: usize, given: &v1::Sensor, names: &[String]) -> Result<Sensor, ServiceError> {
    let invalid = |field: &str, wanted: &str, found: String| {
        ServiceError::invalid(
            format_args!("sensors.sensors[{index}].{field}"),
            wanted,
            found,
        )
    };
    let vector = |given: &v1::Vector| DVec3::new(given.x, given.y, given.z);
    let direction = |field: &str, given: Option<&v1::Vector>| {
        let found = given.map(vector).unwrap_or_default();
        // what has the length 1 keeps its bits
        let unit = if found.is_normalized() {
            Some(found)
        } else {
            found.try_normalize()
        };
        let wanted = "a direction of a length above 0";
        unit.ok_or_else(|| invalid(field, wanted, found.to_string()))
    };
    let name = names
        .get(given.name as usize)
        .ok_or_else(|| invalid("name", "a number of sensors.names", given.name.to_string()))?;
    let at = given.at_m.as_ref().map(vector);
    let at = at.ok_or_else(|| invalid("at_m", "a place", "none".to_owned()))?;
    let shape = match (&given.first_edge_m, &given.second_edge_m) {
        (None, None) => Shape::Point(at),
        (Some(a), Some(b)) => {
            let edges = [vector(a), vector(b)];
            if edges[0].cross(edges[1]).try_normalize().is_none() {
                let wanted = "an edge that makes a surface with the first";
                return Err(invalid("second_edge_m", wanted, edges[1].to_string()));
            }
            if given.triangle {
                Shape::Triangle(at, edges)
            } else {
                Shape::Parallelogram(at, edges)
            }
        }
        _ => {
            return Err(invalid(
                "second_edge_m",
                "two edges or none",
                "one".to_owned(),
            ));
        }
    };
    let receives = match &given.receives {
        Some(Sent::Side(side)) => Receives::Side {
            facing: direction("side.facing", side.facing.as_ref())?,
            lower: side.lower,
        },
        Some(Sent::Everywhere(_)) => Receives::Everywhere,
        Some(Sent::From(from)) if matches!(shape, Shape::Point(_)) => {
            Receives::From(direction("from", Some(from))?)
        }
        Some(Sent::From(_)) => {
            return Err(invalid(
                "from",
                "radiance of a point",
                "that of a surface".to_owned(),
            ));
        }
        None => {
            let wanted = "one of side, everywhere and from";
            return Err(invalid("receives", wanted, "none".to_owned()));
        }
    };
    Ok(Sensor {
        name: name.clone(),
        shape,
        receives,
        rays: given.rays.unwrap_or(DEFAULT_RAYS),
    })
}
