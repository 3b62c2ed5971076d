//! How much of the error each part of a plan gets, for the least cost.
//!
//! The error of each part is taken to fall in proportion to what it is planned for, and its cost to rise with
//! the square. The least cost of a sum of squares then gives each part a share of the square that goes with the
//! root of its cost times its error (Lagrange).

use super::work::{PARTS, PerPart};

/// Parts that are not of what is traced: where the others stay, nothing is traced again.
pub(super) const OF_LIGHT: [bool; PARTS] = [false, true, true, false, false];

/// Factors on errors, at most 1, that bring the sum of squares of each band down to 1 for the least cost.
///
/// With a multiplier m for each band, the squares of the factors are `sqrt(cost / sum of m e²)` (Lagrange); a
/// multiplier grows while its band's sum is too large, and shrinks while it has room.
pub(super) fn allot(bands: &[PerPart], cost_s: &PerPart) -> PerPart {
    const STEPS: usize = 200;
    let mut multipliers = vec![1.0; bands.len()];
    let mut squares = [1.0; PARTS];
    let sum = |band: &PerPart, squares: &PerPart| -> f64 {
        band.iter().zip(squares).map(|(e, s)| e * s).sum()
    };
    for _ in 0..STEPS {
        squares = std::array::from_fn(|k| {
            let price: f64 = bands
                .iter()
                .zip(&multipliers)
                .map(|(band, m)| m * band[k])
                .sum();
            let cost = cost_s[k].max(f64::MIN_POSITIVE);
            if price > 0.0 {
                (cost / price).sqrt().min(1.0)
            } else {
                1.0
            }
        });
        for (band, m) in bands.iter().zip(&mut multipliers) {
            *m *= sum(band, &squares);
        }
    }
    // what the steps leave
    let most = bands
        .iter()
        .map(|band| sum(band, &squares))
        .fold(1.0, f64::max);
    squares.map(|s| (s / most).sqrt())
}

/// The same where what was traced stays as it is; none where it errs too much for that.
pub(super) fn allot_to_light(bands: &[PerPart], cost_s: &PerPart) -> Option<PerPart> {
    let mut of_light = Vec::new();
    for band in bands {
        let sum = |light: bool| -> f64 {
            let parts = band.iter().zip(OF_LIGHT);
            parts.filter(|(_, is)| *is == light).map(|(e, _)| e).sum()
        };
        let room = 1.0 - sum(false);
        if room <= 0.0 {
            return None;
        }
        of_light.push(std::array::from_fn(|k| {
            if OF_LIGHT[k] { band[k] / room } else { 0.0 }
        }));
    }
    let factors = allot(&of_light, cost_s);
    Some(std::array::from_fn(|k| {
        if OF_LIGHT[k] { factors[k] } else { 1.0 }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_other_split_of_the_error_costs_less() {
        let (errors, cost) = ([0.8, 0.6, 0.0, 0.9, 0.2], [1.0, 0.5, 0.0, 0.3, 0.4]);
        let of = |f: &PerPart| (0..PARTS).map(|k| cost[k] / (f[k] * f[k])).sum::<f64>();
        let best = allot(&[errors.map(|e: f64| e * e / 0.2)], &cost);
        let all: f64 = (0..PARTS).map(|k| (best[k] * errors[k]).powi(2)).sum();
        assert!((all / 0.2 - 1.0).abs() < 1e-9, "{all}");
        for (a, b) in [(0, 1), (0, 3), (1, 3), (3, 4)] {
            for step in [-0.01, 0.01] {
                let mut other = best;
                let square = |f: f64, k: usize| (f * errors[k]).powi(2);
                other[a] = best[a] * (1.0 + step);
                let left = square(best[a], a) + square(best[b], b) - square(other[a], a);
                other[b] = left.sqrt() / errors[b];
                assert!(of(&other) > of(&best), "{other:?}");
            }
        }
    }

    /// Bands were brought down one after the other, each by all of its parts: direct light that PAR needed was made
    /// 15 times finer by the time that NIR had had its turn, where 6 times are enough.
    #[test]
    fn a_part_that_one_band_needs_is_no_finer_for_the_sake_of_another() {
        let bands = [[0.284, 2.0, 0.0, 0.3, 0.0], [0.596, 0.6, 0.0, 1.0, 0.0]];
        let squares = bands.map(|band| band.map(|e: f64| (e / 0.45).powi(2)));
        let factors = allot(&squares, &[1.45, 0.02, 0.0, 0.8, 0.0]);
        for band in squares {
            let sum: f64 = (0..PARTS).map(|k| band[k] * factors[k].powi(2)).sum();
            assert!(sum < 1.000_001, "{sum} {factors:?}");
        }
        assert!(factors[1] > 0.15, "{factors:?}");
    }
}
