//! Variance of systematic sampling: a sum over equally spaced rows, laid at random, in place of an integral.
//!
//! What an organ shows to the source is counted by a lattice of points. Along its rows the count is a systematic
//! sample of the function g: how much the organ shows at each height. Its variance follows from how much g differs
//! between rows (Matheron's transitive theory; Gundersen & Jensen 1987), once it is known how smooth g is, which the
//! differences between rows one, two and four apart tell (Kiêu, Souchet & Istas 1999; García-Fiñana & Cruz-Orive 2004):
//!
//! ```text
//!     Var = α(q) (3 C0 - 4 C1 + C2),   C_k = sum of g_j g_(j+k)
//!     α(q) = Γ(2q+2) ζ(2q+2) cos(πq) / ((2π)^(2q+2) (1 - 2^(2q-1)))
//!     2q+1 = log2 of (3 C0 - 4 C2 + C4) / (3 C0 - 4 C1 + C2)
//! ```
//!
//! q = 0 where g jumps, as at an edge that runs along the rows (an edge of n points: n²/12), 1/2 at a smooth rim, 1
//! where g has kinks only.

/// 3 C0 - 4 C1 + C2 of the function that two classes show, for rows one apart and two apart.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Roughness(pub(super) [f64; 2]);

impl Roughness {
    /// Of two functions, from how much each changes from one row to the next: all rows where it is not zero.
    /// `closed`: the first row follows the last.
    ///
    /// With γ_k the sum of (g_(j+k) - g_j) squared, 3 C0 - 4 C1 + C2 is 2 γ1 - γ2/2.
    pub(super) fn of(a: &[i32], b: &[i32], closed: bool) -> Self {
        let n = a.len();
        let at = |steps: &[i32], k: usize| steps.get(k).map_or(0.0, |&step| f64::from(step));
        let [mut one, mut two, mut four] = [0.0; 3];
        // changes over four rows that end with row k: before the first and after the last one nothing changes
        let [mut w, mut v] = [[0.0f64; 4]; 2];
        if closed && n > 0 {
            let last = |k: usize| (k + 4 * n - 4) % n;
            (w, v) = (
                [0, 1, 2, 3].map(|k| at(a, last(k))),
                [0, 1, 2, 3].map(|k| at(b, last(k))),
            );
        }
        for k in 0..if closed { n } else { n + 3 } {
            w = [w[1], w[2], w[3], at(a, k)];
            v = [v[1], v[2], v[3], at(b, k)];
            one += w[3] * v[3];
            two += (w[2] + w[3]) * (v[2] + v[3]);
            four += (w[0] + w[1] + w[2] + w[3]) * (v[0] + v[1] + v[2] + v[3]);
        }
        Self([2.0 * one - 0.5 * two, 2.0 * two - 0.5 * four])
    }

    /// The variance of the sum over rows.
    pub(super) fn variance(&self) -> f64 {
        let [one, two] = self.0;
        if one <= 0.0 {
            return 0.0;
        }
        let smoothness = 0.5 * ((two / one).max(1.0).log2() - 1.0);
        alpha(smoothness.clamp(0.0, 1.0)) * one
    }
}

/// α(q) between its values at 0, 1/2 (a limit) and 1: a parabola of its logarithm, right to 3 %.
fn alpha(q: f64) -> f64 {
    const AT: [f64; 3] = [1.0 / 12.0, 0.021_97, 1.0 / 240.0];
    let [a, b, c] = AT.map(f64::ln);
    let log = a * 2.0 * (q - 0.5) * (q - 1.0) - b * 4.0 * q * (q - 1.0) + c * 2.0 * q * (q - 0.5);
    log.exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Variance of the sum over rows of a function, over all places of the rows, and the mean of what is estimated.
    fn true_and_estimated(g: impl Fn(f64) -> f64) -> [f64; 2] {
        let (rows, places) = (64, 500);
        let mut sums = Vec::new();
        let mut estimated = 0.0;
        for place in 0..places {
            let at = |row: i32| g(f64::from(row) + (f64::from(place) + 0.5) / f64::from(places));
            let counts: Vec<i32> = (0..rows).map(|row| at(row).round() as i32).collect();
            sums.push(counts.iter().map(|&n| f64::from(n)).sum::<f64>());
            let steps: Vec<i32> = counts.windows(2).map(|w| w[1] - w[0]).collect();
            estimated += Roughness::of(&steps, &steps, false).variance() / f64::from(places);
        }
        let mean = sums.iter().sum::<f64>() / sums.len() as f64;
        let variance = sums.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / sums.len() as f64;
        [variance, estimated]
    }

    /// Widths in rows that are not whole numbers: on average over them an edge of n points leaves n²/12.
    #[test]
    fn edges_along_the_rows_leave_a_sixth_of_their_square() {
        let mut sum = [0.0; 2];
        for k in 0..10 {
            let width = 20.0 + (f64::from(k) + 0.5) / 10.0;
            let of = true_and_estimated(|v| {
                if (10.0..10.0 + width).contains(&v) {
                    1e4
                } else {
                    0.0
                }
            });
            sum = [sum[0] + of[0] / 10.0, sum[1] + of[1] / 10.0];
        }
        assert!((sum[0] / (1e8 / 6.0) - 1.0).abs() < 0.02, "{sum:?}");
        assert!((sum[1] / sum[0] - 1.0).abs() < 0.1, "{sum:?}");
    }

    /// Chords of a disc, with radii that are not whole numbers.
    #[test]
    fn a_smooth_rim_leaves_less() {
        let mut sum = [0.0; 2];
        for k in 0..10 {
            let r = 15.0 + f64::from(k) / 10.0;
            let of = true_and_estimated(|v| 1e4 * (r * r - (v - 32.0).powi(2)).max(0.0).sqrt());
            sum = [sum[0] + of[0], sum[1] + of[1]];
        }
        let ratio = sum[1] / sum[0];
        assert!((0.6..1.6).contains(&ratio), "{ratio}");
    }

    #[test]
    fn what_is_the_same_in_all_rows_of_a_torus_leaves_nothing() {
        assert_eq!(Roughness::of(&[0; 7], &[0; 7], true).variance(), 0.0);
        // a strip of one row, wherever it lies
        let strip = |k: usize| {
            let mut steps = [0; 7];
            (steps[k], steps[(k + 1) % 7]) = (1, -1);
            Roughness::of(&steps, &steps, true).variance()
        };
        for k in 0..7 {
            assert!((strip(k) - 0.25).abs() < 1e-12, "{}", strip(k));
        }
    }
}
