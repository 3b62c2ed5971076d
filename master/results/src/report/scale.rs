//! Colour scales: which value of absorbed light has which colour.
//!
//! Light in a canopy spans two or three powers of ten: on a linear scale all that is shaded has one colour. A
//! scale can therefore be read in three ways, and the page lets the reader choose; the picture is logarithmic.

use serde::Serialize;

/// The part of the area that may be brighter than a scale goes, and as much darker: triangles are noisy.
const OFF_SCALE: f64 = 0.005;
/// A scale goes down to this part of its upper end, at most.
const DARKEST: f64 = 1e-3;
/// Steps between the quantiles of a scale.
const STEPS: usize = 32;

/// The scale of one band.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Scale {
    /// Lower end of the logarithmic scale, `> 0` unless all is dark.
    pub(crate) low_W_m2: f64,
    /// Upper end of the linear and of the logarithmic scale.
    pub(crate) top_W_m2: f64,
    /// What 0, 1, 2, ... 32 parts in 32 of the area stay below; none is above the upper end.
    pub(crate) quantiles_W_m2: Vec<f64>,
}

impl Scale {
    /// Of values that each stand for an area.
    pub(crate) fn of(values: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut values: Vec<(f64, f64)> = values.filter(|&(_, area)| area > 0.0).collect();
        values.sort_by(|a, b| a.0.total_cmp(&b.0));
        let top = quantile(&values, 1.0 - OFF_SCALE);
        let lit = &values[values.partition_point(|&(value, _)| value <= 0.0)..];
        let low = quantile(lit, OFF_SCALE);
        Self {
            // two ends of a scale are never the same
            low_W_m2: low.clamp(DARKEST * top, 0.5 * top),
            top_W_m2: top,
            quantiles_W_m2: (0..=STEPS)
                .map(|k| quantile(&values, k as f64 / STEPS as f64).min(top))
                .collect(),
        }
    }

    /// Where a value is on the logarithmic scale, 0 to 1.
    pub(crate) fn part(&self, value: f64) -> f64 {
        if value > self.low_W_m2 {
            ((value / self.low_W_m2).ln() / (self.top_W_m2 / self.low_W_m2).ln()).min(1.0)
        } else {
            0.0
        }
    }

    /// The value that is there on the logarithmic scale.
    pub(crate) fn value(&self, part: f64) -> f64 {
        if self.top_W_m2 > 0.0 {
            self.low_W_m2 * (self.top_W_m2 / self.low_W_m2).powf(part)
        } else {
            0.0
        }
    }
}

/// The smallest value that `part` of the area does not exceed, 0 where there is none. `values` are sorted.
fn quantile(values: &[(f64, f64)], part: f64) -> f64 {
    let mut left = part * values.iter().map(|&(_, area)| area).sum::<f64>();
    for &(value, area) in values {
        left -= area;
        if left <= 0.0 {
            return value;
        }
    }
    // what rounding has left over
    values.last().map_or(0.0, |&(value, _)| value)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of the area in the sun, the other half in ever deeper shade.
    fn canopy() -> Vec<(f64, f64)> {
        let sun = (0..100).map(|k| (200.0 + f64::from(k), 1.0));
        let shade = (0..100).map(|k| (20.0 * 0.96_f64.powi(k), 1.0));
        sun.chain(shade).collect()
    }

    #[test]
    fn shade_was_all_of_one_colour() {
        let scale = Scale::of(canopy().into_iter());
        let (bright, deep) = (scale.part(20.0), scale.part(0.5));
        assert!(bright - deep > 0.4, "{bright} {deep}");
        // on the linear scale it is a fourteenth
        assert!((20.0 - 0.5) / scale.top_W_m2 < 0.07);
        // and of the area, half is darker than the darkest leaf in the sun
        assert!(scale.quantiles_W_m2[16] <= 20.0 && scale.quantiles_W_m2[17] >= 200.0);
    }

    #[test]
    fn the_ends_leave_out_a_few_noisy_triangles() {
        let mut values = canopy();
        values.extend([(9e9, 0.9), (1e-9, 0.9), (5.0, 0.0)]);
        let scale = Scale::of(values.into_iter());
        assert_eq!(scale.top_W_m2, 299.0);
        assert_eq!(scale.quantiles_W_m2[STEPS], 299.0);
        assert!(scale.low_W_m2 > 0.3 && scale.low_W_m2 < 0.4, "{scale:?}");
        for part in [0.0, 0.3, 1.0] {
            assert!((scale.part(scale.value(part)) - part).abs() < 1e-12);
        }
    }

    #[test]
    fn dark_empty_and_uniform_canopies_have_scales() {
        for values in [vec![], vec![(0.0, 1.0); 3]] {
            let scale = Scale::of(values.into_iter());
            assert_eq!((scale.part(0.0), scale.value(0.5)), (0.0, 0.0));
            assert!(scale.quantiles_W_m2.iter().all(|&q| q == 0.0));
        }
        let scale = Scale::of([(7.0, 1.0); 3].into_iter());
        assert_eq!((scale.part(7.0), scale.part(0.0)), (1.0, 0.0));
    }
}
