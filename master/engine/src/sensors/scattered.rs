//! Light that was scattered to a sensor: the mean radiosity of what its rays meet.

use nestrad_common::sensors::{Receives, Sensor};
use rand::RngExt;

use super::eyes::Eyes;
use super::field::{Field, VARIANTS, Variant};
use super::sample::{Points, any_direction, cosine_direction};
use super::{Part, REPLICATES, mean_and_variance};
use crate::solution::Estimate;

/// What is scattered to a sensor, per band.
///
/// The standard error holds that of the rays, half of what the two halves of the exchange differ by, and that of the
/// direct light on what the rays meet. The bias tells what the sensor would read were elements, or cells of the soil, larger, as that of organs does.
pub(super) fn of(field: &Field, eyes: &Eyes, sensor: &Sensor, rng: &mut impl RngExt) -> Vec<Part> {
    let mut all_met = Vec::new();
    let sets: Vec<Vec<f64>> = match sensor.receives {
        // a ray is all that there is
        Receives::From(direction) => {
            let met = eyes.met(sensor, sensor.centre_m(), direction);
            all_met.push(met);
            vec![field.at(met).to_vec()]
        }
        _ => (0..REPLICATES)
            .map(|_| mean_of_set(field, eyes, sensor, &Points::new(rng), &mut all_met))
            .collect(),
    };
    let factor = sensor.of_unit_radiosity();
    let of_direct = of_direct(field, all_met);
    let of_band = |b: usize| {
        let of = |variant: Variant| -> Vec<f64> {
            let values = sets.iter().map(|set| set[b * VARIANTS + variant as usize]);
            values.map(|value| factor * value).collect()
        };
        let (x, y) = (of(Variant::FirstHalf), of(Variant::SecondHalf));
        let both: Vec<f64> = x.iter().zip(&y).map(|(x, y)| 0.5 * (x + y)).collect();
        let (value, of_rays) = if both.len() > 1 {
            mean_and_variance(&both)
        } else {
            (both[0], 0.0)
        };
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let halves = 0.5 * (mean(&x) - mean(&y));
        let change = |variant: Variant| mean(&of(variant)) - value;
        let elements = match field.wider {
            wider if wider > 1.0 => change(Variant::LargerElements) / (wider - 1.0),
            _ => 0.0,
        };
        let cells = [Variant::LargerCells, Variant::OtherLargerCells].map(change);
        let soil = 0.5 * (cells[0] * cells[0] + cells[1] * cells[1]);
        Part {
            light: Estimate {
                value,
                se: (of_rays + halves * halves + factor * factor * of_direct[b]).sqrt(),
            },
            bias: (elements * elements + soil).sqrt(),
        }
    };
    (0..field.bands()).map(of_band).collect()
}

/// Variance of the mean over ends that were met, each as often as it stands here, by that of the direct light on them.
fn of_direct(field: &Field, mut met: Vec<u32>) -> Vec<f64> {
    met.sort_unstable();
    let mut variances = vec![0.0; field.bands()];
    for same in met.chunk_by(|a, b| a == b) {
        let part = same.len() as f64 / met.len() as f64;
        let values = field.at(same[0]);
        for (b, variance) in variances.iter_mut().enumerate() {
            *variance += part * part * values[b * VARIANTS + Variant::DirectVariance as usize];
        }
    }
    variances
}

/// Mean over a set of rays of what they meet, which is told too.
fn mean_of_set(
    field: &Field,
    eyes: &Eyes,
    sensor: &Sensor,
    points: &Points<4>,
    all_met: &mut Vec<u32>,
) -> Vec<f64> {
    let rays = sensor.rays / REPLICATES;
    let mut sums = vec![0.0; field.bands() * VARIANTS];
    for j in 0..rays {
        let [u, v, p, q] = points.point(j);
        let direction = match sensor.receives {
            Receives::Side { facing, .. } => cosine_direction(facing, [u, v]),
            Receives::Everywhere => any_direction([u, v]),
            Receives::From(direction) => direction,
        };
        let met = eyes.met(sensor, sensor.shape.point_m([p, q]), direction);
        all_met.push(met);
        for (sum, value) in sums.iter_mut().zip(field.at(met)) {
            *sum += value;
        }
    }
    for sum in &mut sums {
        *sum /= f64::from(rays);
    }
    sums
}
