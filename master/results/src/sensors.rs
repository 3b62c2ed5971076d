//! The tables of sensors: irradiances, and radiances from directions.

use glam::DVec3;
use nestrad_common::sensors::{Receives, Sensor};
use nestrad_engine::solution::{Reading, SensorLight};

use crate::table::{Column, Table};

/// Readings of one kind, and where they were taken.
struct Readings<'a> {
    of: Vec<&'a Reading>,
    origin_m: DVec3,
    bands: &'a [&'a str],
}

/// The tables of a solution's readings that have rows.
pub(crate) fn tables<'a>(
    origin_m: DVec3,
    bands: &'a [&'a str],
    readings: &'a [Reading],
) -> Vec<Table<'a>> {
    let (radiances, irradiances): (Vec<_>, Vec<_>) = readings
        .iter()
        .partition(|reading| matches!(reading.sensor.receives, Receives::From(_)));
    let readings = |of| Readings {
        of,
        origin_m,
        bands,
    };
    let mut tables = Vec::new();
    if !irradiances.is_empty() {
        tables.push(sensors(readings(irradiances)));
    }
    if !radiances.is_empty() {
        tables.push(radiance(readings(radiances)));
    }
    tables
}

/// One row per sensor, side and band.
fn sensors(readings: Readings<'_>) -> Table<'_> {
    let side = |sensor: &Sensor| sensor.side();
    let [name, x, y, z] = readings.places();
    let columns = vec![
        name,
        x,
        y,
        z,
        readings.text("side", side),
        readings.band(),
        readings.quantity("irradiance_direct_W_m2", |light| light.direct.value),
        readings.quantity("irradiance_scattered_W_m2", |light| light.scattered.value),
        readings.quantity("irradiance_W_m2", |light| light.total().value),
        readings.quantity("irradiance_direct_se_W_m2", |light| light.direct.se),
        readings.quantity("irradiance_scattered_se_W_m2", |light| light.scattered.se),
        readings.quantity("irradiance_se_W_m2", |light| light.total().se),
        readings.quantity("irradiance_bias_W_m2", |light| light.bias),
    ];
    Table {
        name: "sensors",
        rows: readings.rows(),
        columns,
    }
}

/// One row per sensor, direction and band.
fn radiance(readings: Readings<'_>) -> Table<'_> {
    let [name, x, y, z] = readings.places();
    let columns = vec![
        name,
        x,
        y,
        z,
        readings.from("from_x", |from| from.x),
        readings.from("from_y", |from| from.y),
        readings.from("from_z", |from| from.z),
        readings.band(),
        readings.quantity("radiance_sky_W_m2_sr", |light| light.direct.value),
        readings.quantity("radiance_scattered_W_m2_sr", |light| light.scattered.value),
        readings.quantity("radiance_W_m2_sr", |light| light.total().value),
        readings.quantity("radiance_se_W_m2_sr", |light| light.total().se),
        readings.quantity("radiance_bias_W_m2_sr", |light| light.bias),
    ];
    Table {
        name: "radiance",
        rows: readings.rows(),
        columns,
    }
}

impl<'a> Readings<'a> {
    fn rows(&self) -> usize {
        self.of.len() * self.bands.len()
    }

    /// Name and centre, in the user's coordinates.
    fn places(&self) -> [Column<'a>; 4] {
        let at = |name, of: fn(DVec3) -> f64| {
            let (list, origin_m, bands) = (self.of.clone(), self.origin_m, self.bands.len());
            Column::coordinate(name, move |row| {
                of(origin_m + list[row / bands].sensor.centre_m())
            })
        };
        [
            self.text("name", |sensor| &sensor.name),
            at("x_m", |p| p.x),
            at("y_m", |p| p.y),
            at("z_m", |p| p.z),
        ]
    }

    fn text(&self, name: &'static str, of: fn(&Sensor) -> &str) -> Column<'a> {
        let (list, bands) = (self.of.clone(), self.bands.len());
        Column::text(name, move |row| of(&list[row / bands].sensor))
    }

    fn band(&self) -> Column<'a> {
        let bands = self.bands;
        Column::text("band", move |row| bands[row % bands.len()])
    }

    fn from(&self, name: &'static str, of: fn(DVec3) -> f64) -> Column<'a> {
        let (list, bands) = (self.of.clone(), self.bands.len());
        Column::quantity(name, move |row| match list[row / bands].sensor.receives {
            Receives::From(direction) => of(direction),
            Receives::Side { .. } | Receives::Everywhere => 0.0,
        })
    }

    fn quantity(&self, name: &'static str, of: fn(&SensorLight) -> f64) -> Column<'a> {
        let (list, bands) = (self.of.clone(), self.bands.len());
        Column::quantity(name, move |row| of(&list[row / bands].light[row % bands]))
    }
}
