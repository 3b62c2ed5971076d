//! Light that comes to a sensor straight from the sources: by rays towards each of them.

use glam::DVec3;
use nestrad_common::light::Source;
use nestrad_common::sensors::{Receives, Sensor, Shape};
use rand::RngExt;

use super::eyes::Eyes;
use super::sample::Points;
use super::{Part, REPLICATES, Surroundings, mean_and_variance};
use crate::account::TWICE_AS_MANY;
use crate::solution::Estimate;

/// What comes straight from the sources, per band.
///
/// A point either sees a source or not. Over a surface the standard error is that of the points which look at the sources;
/// the bias is that of directions in place of a whole sky.
pub(super) fn of(
    around: &Surroundings,
    eyes: &Eyes,
    sensor: &Sensor,
    rng: &mut impl RngExt,
) -> Vec<Part> {
    if let Receives::From(direction) = sensor.receives {
        return of_sky(around, eyes, sensor, direction);
    }
    let bands = around.optics.len();
    let sets: Vec<Vec<[f64; PARTS]>> = match sensor.shape {
        Shape::Point(_) => vec![of_set(around, eyes, sensor, None)],
        _ => (0..REPLICATES)
            .map(|_| of_set(around, eyes, sensor, Some(&Points::new(rng))))
            .collect(),
    };
    let of_band = |b: usize| {
        let all: Vec<f64> = sets.iter().map(|set| set[b].iter().sum()).collect();
        let (value, variance) = if all.len() > 1 {
            mean_and_variance(&all)
        } else {
            (all[0], 0.0)
        };
        let mean =
            |part: usize| sets.iter().map(|set| set[b][part]).sum::<f64>() / sets.len() as f64;
        let halves = [0, 1].map(|half| mean(half) * whole_of_half(around, b, half));
        // what halves differ by, but for what the points do, as for organs
        let of_both = (halves[0] - halves[1]).powi(2) - 4.0 * variance;
        Part {
            light: Estimate {
                value,
                se: variance.sqrt(),
            },
            bias: (0.5 * of_both.max(0.0) * TWICE_AS_MANY).sqrt(),
        }
    };
    (0..bands).map(of_band).collect()
}

/// Every other direction of a sky, the others, and what is not of a sky.
const PARTS: usize = 3;

/// One set: a point for each source, or several for those that matter.
fn of_set(
    around: &Surroundings,
    eyes: &Eyes,
    sensor: &Sensor,
    points: Option<&Points<2>>,
) -> Vec<[f64; PARTS]> {
    let sources = around.sources;
    let mut sums = vec![[0.0; PARTS]; around.optics.len()];
    let mut next = 0;
    for (k, source) in sources.list.iter().enumerate() {
        let towards = -source.direction;
        let cosine = match sensor.receives {
            Receives::Side { facing, .. } => facing.dot(towards).max(0.0),
            Receives::Everywhere | Receives::From(_) => 1.0,
        };
        if cosine == 0.0 {
            continue;
        }
        let part = match points {
            None => {
                let sees = eyes.sees_sky(sensor, sensor.centre_m(), towards);
                f64::from(u8::from(sees))
            }
            Some(points) => {
                let count = looks(around, sensor, source);
                let sees = |j: &u32| {
                    let at = sensor.shape.point_m(points.point(next + j));
                    eyes.sees_sky(sensor, at, towards)
                };
                let seen = (0..count).filter(sees).count();
                next += count;
                seen as f64 / f64::from(count)
            }
        };
        let which = if k < sources.sky_directions { k % 2 } else { 2 };
        for (sum, irradiance) in sums.iter_mut().zip(&source.irradiance_W_m2) {
            sum[which] += part * cosine * irradiance / towards.z;
        }
    }
    sums
}

/// How many points of a set look at a source: as many as its part of the light, in the band where that is largest.
fn looks(around: &Surroundings, sensor: &Sensor, source: &Source) -> u32 {
    let of_band = |(b, own): (usize, &f64)| own / around.irradiance_W_m2(b).max(f64::MIN_POSITIVE);
    let part = source.irradiance_W_m2.iter().enumerate().map(of_band);
    let rays = f64::from(sensor.rays / REPLICATES);
    (rays * part.fold(0.0, f64::max)).ceil().max(1.0) as u32
}

/// All light of a sky over that of every other of its directions.
fn whole_of_half(around: &Surroundings, band: usize, half: usize) -> f64 {
    let sky = &around.sources.list[..around.sources.sky_directions];
    let of = |list: &mut dyn Iterator<Item = &Source>| -> f64 {
        list.map(|source| source.irradiance_W_m2[band]).sum()
    };
    let own = of(&mut sky.iter().skip(half).step_by(2));
    if own > 0.0 {
        of(&mut sky.iter()) / own
    } else {
        0.0
    }
}

/// Radiance of the sky where a sensor looks at it. Parallel sources have none.
fn of_sky(around: &Surroundings, eyes: &Eyes, sensor: &Sensor, direction: DVec3) -> Vec<Part> {
    let mut parts = vec![Part::default(); around.optics.len()];
    if let Some(sky) = &around.sources.sky
        && eyes.sees_sky(sensor, sensor.centre_m(), direction)
    {
        for (part, value) in parts.iter_mut().zip(sky.radiance_W_m2_sr(direction)) {
            part.light.value = value;
        }
    }
    parts
}

impl Surroundings<'_> {
    /// Irradiance of the horizontal above all, W m⁻².
    fn irradiance_W_m2(&self, band: usize) -> f64 {
        let of = |source: &Source| source.irradiance_W_m2[band];
        self.sources.list.iter().map(of).sum()
    }
}
