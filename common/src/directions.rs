//! Directions of the parallel lines: uniform in solid angle, well spread, in independent batches.

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Turn between successive azimuths that never repeats: the golden angle, as a part of a turn.
const GOLDEN_TURN: f64 = 0.618_033_988_749_894_8;

/// A generator whose numbers depend on nothing but the seed and what they are for.
pub fn stream(seed: u64, purpose: Purpose, index: u64) -> Pcg64Mcg {
    // SplitMix64's finaliser over the three words keeps neighbouring streams apart
    // (Steele, Lea & Flood 2014).
    let mix = |mut x: u64| {
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let word = mix(seed ^ mix((purpose as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ mix(index)));
    Pcg64Mcg::seed_from_u64(word)
}

/// What random numbers are drawn for; each purpose has streams of its own.
#[derive(Clone, Copy, Debug)]
pub enum Purpose {
    /// Directions and lattice offsets of the exchange lines.
    Lines = 1,
    /// Lattice offsets of the direct light.
    Direct = 2,
    /// Rays from faces.
    Rays = 3,
    /// Lines through the whole scene that the far field averages over.
    FarField = 4,
    /// Rotation of a built-in sky.
    Sky = 5,
}

/// `count` upward unit vectors, uniform over the hemisphere: one in each of `count` equal slices
/// of `cos(theta)` (all at the same random place of their slice), with azimuths that turn by the
/// golden angle from a random start.
///
/// Each vector by itself is exactly uniform over the hemisphere, so any sum over them is unbiased.
pub fn hemisphere(count: u32, rng: &mut Pcg64Mcg) -> Vec<DVec3> {
    let (place, start): (f64, f64) = (rng.random(), rng.random());
    (0..count)
        .map(|k| {
            // never exactly horizontal
            let z = ((f64::from(k) + place) / f64::from(count)).clamp(1e-9, 1.0);
            let azimuth = std::f64::consts::TAU * (start + f64::from(k) * GOLDEN_TURN).fract();
            let r = (1.0 - z * z).max(0.0).sqrt();
            DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_the_hemisphere() {
        let n = 4096;
        let d = hemisphere(n, &mut stream(7, Purpose::Lines, 0));
        let mean = d.iter().copied().sum::<DVec3>() / f64::from(n);
        assert!((mean - DVec3::new(0.0, 0.0, 0.5)).length() < 2e-3, "{mean}");
        let xx = d.iter().map(|d| d.x * d.x).sum::<f64>() / f64::from(n);
        let zz = d.iter().map(|d| d.z * d.z).sum::<f64>() / f64::from(n);
        assert!((xx - 1.0 / 3.0).abs() < 2e-3 && (zz - 1.0 / 3.0).abs() < 2e-3);
        assert!(
            d.iter()
                .all(|d| (d.length() - 1.0).abs() < 1e-12 && d.z > 0.0)
        );
    }

    #[test]
    fn streams_differ_by_seed_purpose_and_index() {
        let first = |s, p, i| stream(s, p, i).random::<u64>();
        let base = first(1, Purpose::Lines, 1);
        assert_eq!(base, first(1, Purpose::Lines, 1));
        assert_ne!(base, first(2, Purpose::Lines, 1));
        assert_ne!(base, first(1, Purpose::Rays, 1));
        assert_ne!(base, first(1, Purpose::Lines, 2));
    }
}
