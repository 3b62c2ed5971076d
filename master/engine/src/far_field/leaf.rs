//! How leaves of one inclination, all azimuths alike, meet light of a polar bin.
//!
//! Notation: `mu = |cos(zenith angle)|` of the light; `c` the cosine of the leaves' inclination,
//! the acute angle between leaf normal and vertical, so `0 <= c <= 1`. The normal is the one that
//! points skyward; its face is the *skyward* face, the other one the *groundward* face.

use std::f64::consts::{FRAC_1_PI, FRAC_2_PI};

/// Projection function `G(mu)`: mean over leaf azimuth of `|cos(light, normal)|`.
///
/// Between 0 and 1. Ross 1981; Shultis & Myneni 1988; rewritten without divisions:
/// `mu c` where the light never grazes the leaf (`mu >= sqrt(1 - c^2)`), else
/// `2/pi [mu c atan(mu c / w) + w]` with `w = sqrt(1 - c^2 - mu^2)`.
pub(super) fn projection(mu: f64, c: f64) -> f64 {
    let w2 = (1.0 - c) * (1.0 + c) - mu * mu;
    if w2 <= 0.0 {
        return mu * c;
    }
    let w = w2.sqrt();
    FRAC_2_PI * (mu * c * (mu * c).atan2(w) + w)
}

/// The integral of [`projection`] over `mu` from 0 to `mu`; 1/2 at `mu = 1` for any `c`.
///
/// Derived in `docs/far_field.md`.
fn projection_integral(mu: f64, c: f64) -> f64 {
    let s2 = (1.0 - c) * (1.0 + c);
    let w2 = s2 - mu * mu;
    if w2 <= 0.0 {
        return 0.5 * (1.0 - c * (1.0 - mu) * (1.0 + mu));
    }
    let w = w2.sqrt();
    let grazing = (1.0 - mu) * (1.0 + mu) * (mu * c).atan2(w);
    FRAC_1_PI * (mu.atan2(w) + mu * w - c * grazing)
}

/// Polar bins: `m` per hemisphere, uniform in `mu` and so of equal solid angle, `2 pi / m`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bins(pub(super) usize);

impl Bins {
    /// Mean `mu` of bin `b`, which counts from the horizon.
    pub(super) fn mu(self, b: usize) -> f64 {
        (b as f64 + 0.5) / self.0 as f64
    }

    /// Share of a horizontal Lambertian emitter's power that goes into bin `b`; they sum to 1.
    pub(super) fn lambertian(self, b: usize) -> f64 {
        2.0 * self.mu(b) / self.0 as f64
    }
}

/// Leaves of one inclination. Vectors run over the channels: `m` downward bins, from the horizon,
/// then `m` upward ones. Light is counted as flux through a horizontal plane.
#[derive(Clone, Debug)]
pub(super) struct LeafAngle {
    /// Arriving on the skyward face per unit of flux and of leaf area index.
    pub(super) onto_sky_face: Vec<f64>,
    /// Likewise for the groundward face.
    pub(super) onto_ground_face: Vec<f64>,
    /// How the power that leaves the skyward face is shared out; sums to 1.
    pub(super) from_sky_face: Vec<f64>,
    /// Likewise for the groundward face.
    pub(super) from_ground_face: Vec<f64>,
}

impl LeafAngle {
    /// Leaves whose inclination has the cosine `c`, 0 to 1.
    pub(super) fn new(bins: Bins, c: f64) -> Self {
        let m = bins.0;
        let edge = |b: usize| projection_integral(b as f64 / m as f64, c);
        // Mean over a bin of max(0, +-cos(light, normal)): half of G +- mu c, as their difference
        // averages to mu c over leaf azimuth.
        let (along, against): (Vec<f64>, Vec<f64>) = (0..m)
            .map(|b| {
                let g = (edge(b + 1) - edge(b)) * m as f64;
                let tilt = bins.mu(b) * c;
                (0.5 * (g + tilt), (0.5 * (g - tilt)).max(0.0))
            })
            .unzip();
        // Light that travels along the normal leaves the skyward face or arrives on the other.
        let with_normal = [against.as_slice(), &along].concat();
        let against_normal = [along.as_slice(), &against].concat();
        let total: f64 = with_normal.iter().sum();
        let arriving = |p: &[f64]| (0..2 * m).map(|ch| p[ch] / bins.mu(ch % m)).collect();
        let leaving = |p: &[f64]| p.iter().map(|p| p / total).collect();
        Self {
            onto_sky_face: arriving(&against_normal),
            onto_ground_face: arriving(&with_normal),
            from_sky_face: leaving(&with_normal),
            from_ground_face: leaving(&against_normal),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_agrees_with_the_average_over_azimuth() {
        for (mu, c) in [(0.3, 0.8), (0.05, 0.99), (0.7, 0.2), (0.9, 0.6), (0.4, 0.0)] {
            let n = 200_000;
            let (s, t) = (f64::sqrt(1.0 - mu * mu), f64::sqrt(1.0 - c * c));
            let mean = (0..n)
                .map(|i| {
                    let azimuth = std::f64::consts::TAU * (f64::from(i) + 0.5) / f64::from(n);
                    (mu * c + s * t * azimuth.cos()).abs()
                })
                .sum::<f64>()
                / f64::from(n);
            assert!((projection(mu, c) - mean).abs() < 1e-9, "{mu} {c}");
        }
    }

    #[test]
    fn projection_integral_is_its_integral() {
        for c in [0.0, 0.02, 0.3, 0.77, 0.9999, 1.0] {
            assert!((projection_integral(1.0, c) - 0.5).abs() < 1e-15);
            for mu in [0.01, 0.2, 0.63, 1.0] {
                let n = 400_000;
                let sum = (0..n)
                    .map(|i| projection(mu * (f64::from(i) + 0.5) / f64::from(n), c))
                    .sum::<f64>();
                let integral = sum * mu / f64::from(n);
                let closed = projection_integral(mu, c);
                assert!(
                    (closed - integral).abs() < 1e-9,
                    "{mu} {c}: {closed} {integral}"
                );
            }
        }
    }

    #[test]
    fn leaves_are_reciprocal_and_emit_all_they_send_out() {
        for m in [1, 2, 6, 64] {
            let bins = Bins(m);
            for c in [0.0, 1e-9, 0.3, 0.8, 1.0] {
                let leaf = LeafAngle::new(bins, c);
                let sum: f64 = leaf.from_sky_face.iter().sum();
                assert!((sum - 1.0).abs() < 1e-14);
                for ch in 0..2 * m {
                    // A face emits into a channel as it would receive from the opposite one.
                    let opposite = (ch + m) % (2 * m);
                    let share = 2.0 * bins.mu(ch % m) / m as f64;
                    let received = leaf.onto_sky_face[opposite] * share;
                    assert!((leaf.from_sky_face[ch] - received).abs() < 1e-14);
                }
            }
        }
    }
}
