//! Errors against a reference that has an error of its own.

use serde::{Deserialize, Serialize};

/// An error, and where it may lie: above the upper end in one case of ten.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
pub struct ErrorRange {
    /// The error, percent of the mean.
    pub percent: f64,
    /// Lower end, percent.
    pub low_percent: f64,
    /// Upper end, percent.
    pub high_percent: f64,
}

/// Values of a band that others are measured against.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// One-sided area of each organ of plants, m².
    pub area_m2: Vec<f64>,
    /// Absorbed power per area of each, mean over runs, W m⁻².
    pub absorbed_W_m2: Vec<f64>,
    /// Variance of that mean by the scatter of the runs, averaged over area, percent² of the canopy's mean.
    pub variance_percent2: f64,
}

impl Reference {
    /// The mean of independent runs, at least two, each with a value for each organ; none where nothing is
    /// absorbed.
    pub fn of(area_m2: Vec<f64>, runs_W_m2: &[Vec<f64>]) -> Option<Self> {
        let runs = runs_W_m2.len() as f64;
        let organs = 0..area_m2.len();
        let mean_of = |o: usize| runs_W_m2.iter().map(|run| run[o]).sum::<f64>() / runs;
        let absorbed_W_m2: Vec<f64> = organs.map(mean_of).collect();
        let mut reference = Self {
            area_m2,
            absorbed_W_m2,
            variance_percent2: 0.0,
        };
        if runs < 2.0 || reference.mean_W_m2() <= 0.0 {
            return None;
        }
        let squares = runs_W_m2.iter().map(|run| reference.square_percent2(run));
        reference.variance_percent2 = squares.sum::<f64>() / (runs * (runs - 1.0));
        Some(reference)
    }

    /// Absorbed power per area of all plants, W m⁻².
    pub fn mean_W_m2(&self) -> f64 {
        let items = self.area_m2.iter().zip(&self.absorbed_W_m2);
        items.map(|(a, w)| a * w).sum::<f64>() / self.area_m2.iter().sum::<f64>()
    }

    /// Mean over area of the squared difference, percent² of the canopy's mean.
    pub fn square_percent2(&self, absorbed_W_m2: &[f64]) -> f64 {
        let (mut area, mut sum) = (0.0, 0.0);
        for ((a, own), other) in self
            .area_m2
            .iter()
            .zip(&self.absorbed_W_m2)
            .zip(absorbed_W_m2)
        {
            area += a;
            sum += a * (own - other).powi(2);
        }
        1e4 * sum / area / self.mean_W_m2().powi(2)
    }

    /// As many organs of one size would scatter as these do.
    fn effective_organs(&self) -> f64 {
        let area: f64 = self.area_m2.iter().sum();
        area * area / self.area_m2.iter().map(|a| a * a).sum::<f64>()
    }

    /// The error of a setting from the squares of its runs, percent², one for each seed.
    pub fn range(&self, squares_percent2: &[f64]) -> ErrorRange {
        let runs = squares_percent2.len() as f64;
        let mean = squares_percent2.iter().sum::<f64>() / runs;
        let scatter = squares_percent2.iter().map(|s| (s - mean).powi(2));
        let se = (scatter.sum::<f64>() / (runs - 1.0).max(1.0) / runs).sqrt();
        let own = self.variance_percent2;
        // organs err together: the reference's error is known no better than by its size
        let with_reference = 2.0 * (own * mean / self.effective_organs()).sqrt();
        let quantile = student(squares_percent2.len());
        let half = (quantile * se).hypot(NORMAL * own.hypot(with_reference));
        let square = mean - own;
        let root = |square: f64| square.max(0.0).sqrt();
        ErrorRange {
            percent: root(square),
            low_percent: root(square - half),
            high_percent: root(square + half),
        }
    }
}

/// Nine in ten lie below so many standard deviations.
const NORMAL: f64 = 1.28;

/// The same where the standard deviation comes from so few values.
fn student(values: usize) -> f64 {
    const QUANTILES: [f64; 9] = [3.08, 1.89, 1.64, 1.53, 1.48, 1.44, 1.41, 1.40, 1.38];
    let freedom = values.saturating_sub(1).max(1);
    QUANTILES.get(freedom - 1).copied().unwrap_or(1.35)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::SmallRng};

    /// Standard deviation 1.
    fn noise(rng: &mut SmallRng) -> f64 {
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    }

    #[test]
    fn errors_are_unbiased_and_ends_are_above_them() {
        let mut rng = SmallRng::seed_from_u64(1);
        let areas: Vec<f64> = (0..60).map(|o| 1.0 + f64::from(o % 5)).collect();
        let truth: Vec<f64> = (0..60).map(|o| 80.0 + f64::from(o % 7) * 5.0).collect();
        let mut run = |sd: f64, bias: f64| -> Vec<f64> {
            truth
                .iter()
                .map(|t| t + bias + sd * noise(&mut rng))
                .collect()
        };
        let (mut squares, mut covered) = (0.0, 0);
        const TRIALS: usize = 400;
        let mut expected = 0.0;
        for _ in 0..TRIALS {
            let runs: Vec<_> = (0..3).map(|_| run(0.3, 0.0)).collect();
            let reference = Reference::of(areas.clone(), &runs).expect("lit");
            let own: Vec<f64> = (0..3)
                .map(|_| reference.square_percent2(&run(0.5, 0.2)))
                .collect();
            let range = reference.range(&own);
            expected = 1e4 * (0.25 + 0.04) / reference.mean_W_m2().powi(2);
            squares += range.percent.powi(2) / TRIALS as f64;
            covered += usize::from(range.high_percent.powi(2) >= expected);
            assert!(range.low_percent <= range.percent && range.percent <= range.high_percent);
        }
        assert!(
            (squares / expected - 1.0).abs() < 0.03,
            "{squares} {expected}"
        );
        assert!(covered as f64 > 0.87 * TRIALS as f64, "{covered}");
    }

    #[test]
    fn what_absorbs_nothing_is_no_reference() {
        assert_eq!(Reference::of(vec![1.0], &[vec![0.0], vec![0.0]]), None);
        assert_eq!(Reference::of(vec![1.0], &[vec![1.0]]), None);
    }
}
