//! Sensors: the light at places where nothing stands, from a solution that knows nothing of them.
//!
//! Direct light comes by rays towards every source (`direct.rs`), scattered light by rays that look for what sends it: the
//! radiosity of the face or the cell of soil that a ray meets, on the true geometry, however far away (`scattered.rs`).
//! Nothing is traced of a canopy for them, and nothing is changed. Random numbers go with the seed and with the number of
//! a sensor alone.

mod direct;
mod eyes;
mod field;
mod sample;
mod scattered;

use nestrad_common::light::Sources;
use nestrad_common::optics::Optics;
use nestrad_common::sensors::Sensor;
use nestrad_kernel::directions::{Purpose, stream};
use rayon::prelude::*;

use crate::direct::Direct;
use crate::exchange::Outlook;
use crate::frame::Frame;
use crate::run::Run;
use crate::solution::{Estimate, Reading, SensorLight};
use crate::solver::{Groups, Irradiance};
use crate::stop::Stopped;
use eyes::Eyes;
use field::Field;

/// Samples of a sensor are this many sets that are independent of each other: their scatter is the standard error.
const REPLICATES: u32 = 8;

/// A solved light, as sensors see it.
pub(crate) struct Surroundings<'a> {
    /// Elements and soil cells.
    pub frame: &'a Frame,
    /// In the frame's order.
    pub optics: &'a Optics,
    /// What it is lit by.
    pub sources: &'a Sources,
    /// The light that comes straight from them.
    pub direct: &'a Direct,
    /// Of the bands in `scattering`; in others nothing is scattered, or it is not followed.
    pub irradiance: &'a Irradiance,
    /// Numbers of the bands that were solved.
    pub scattering: &'a [usize],
    /// Which radiosities are one where elements are larger; none where no band was solved.
    pub groups: Option<&'a Groups>,
    /// What is buried of the rows.
    pub outlook: &'a Outlook,
    /// See [`outer_soil`](crate::outer_soil).
    pub outer_soil_W_m2: &'a [f64],
    /// Start of all random numbers.
    pub seed: u64,
}

impl Surroundings<'_> {
    /// What all sensors read, in their order.
    pub(crate) fn readings(&self, sensors: &[Sensor], run: &Run) -> Result<Vec<Reading>, Stopped> {
        if sensors.is_empty() {
            return Ok(Vec::new());
        }
        run.progress.stage("sensors", sensors.len() as u64);
        let eyes = Eyes::new(self.frame);
        let field = self.groups.map(|groups| Field::of(self, groups));
        let reading = |(k, sensor): (usize, &Sensor)| {
            run.stop.check()?;
            let mut rng = stream(self.seed, Purpose::Sensors, k as u64);
            let direct = direct::of(self, &eyes, sensor, &mut rng);
            let scattered = match &field {
                Some(field) => scattered::of(field, &eyes, sensor, &mut rng),
                None => Vec::new(),
            };
            let light = direct.into_iter().enumerate().map(|(b, direct)| {
                let scattered = scattered.get(b).copied().unwrap_or_default();
                SensorLight {
                    direct: direct.light,
                    scattered: scattered.light,
                    bias: direct.bias.hypot(scattered.bias),
                }
            });
            let light = light.collect();
            run.progress.inc(1);
            let sensor = sensor.clone();
            Ok(Reading { sensor, light })
        };
        sensors.par_iter().enumerate().map(reading).collect()
    }
}

/// A part of what a sensor reads in a band.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    light: Estimate,
    /// What may be wrong besides.
    bias: f64,
}

/// Mean of values that are independent of each other, and the variance of it.
fn mean_and_variance(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    (mean, squares / (n * (n - 1.0)))
}
