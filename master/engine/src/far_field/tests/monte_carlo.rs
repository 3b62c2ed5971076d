//! Photons in the same plane-parallel medium, with continuous directions and nothing else in common
//! with the solver but the model.

use std::f64::consts::{PI, TAU};

use nestrad_common::optics::FaceOptics;

use super::*;

/// Leaves of two kinds: inclination's cosine, whether the lower face is up, area index.
const LEAVES: [(f64, bool, f64); 2] = [(0.9, false, 1.5), (0.3, true, 1.0)];
const LEAF: LeafOptics = LeafOptics {
    upper: FaceOptics { rho: 0.5, tau: 0.3 },
    lower: FaceOptics { rho: 0.2, tau: 0.6 },
};
const SOIL: f64 = 0.25;
const SUN_MU: f64 = 0.6;
const DEPTH: f64 = 2.5;
/// Bins of the comparison.
const BINS: usize = 3;

/// SplitMix64 (Steele, Lea & Flood 2014), uniform in (0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 + 0.5 / (1_u64 << 53) as f64
    }
}

fn from_polar(mu: f64, azimuth: f64) -> DVec3 {
    let s = (1.0 - mu * mu).max(0.0).sqrt();
    DVec3::new(s * azimuth.cos(), s * azimuth.sin(), mu)
}

/// A direction on the side of `normal`, cosine-distributed.
fn lambertian(normal: DVec3, random: &mut Random) -> DVec3 {
    let on_sphere = from_polar(2.0 * random.next() - 1.0, TAU * random.next());
    (normal + on_sphere).normalize()
}

#[derive(Default, Clone, Copy)]
struct Tally {
    reflected: f64,
    transmitted: f64,
    absorbed: f64,
    /// Scattered flux per bin through the middle of the canopy: up, down.
    middle: [[f64; BINS]; 2],
}

impl Tally {
    fn add(&mut self, other: &Self, weight: f64) {
        self.reflected += weight * other.reflected;
        self.transmitted += weight * other.transmitted;
        self.absorbed += weight * other.absorbed;
        for (a, b) in self
            .middle
            .iter_mut()
            .flatten()
            .zip(other.middle.iter().flatten())
        {
            *a += weight * b;
        }
    }
}

/// A candidate leaf, met with the probability of its projection: its skyward normal, and whether
/// its lower face is up.
fn meet_leaf(direction: DVec3, random: &mut Random) -> Option<(DVec3, bool)> {
    let pick = random.next() * DEPTH;
    let leaf = if pick < LEAVES[0].2 {
        LEAVES[0]
    } else {
        LEAVES[1]
    };
    let skyward = from_polar(leaf.0, TAU * random.next());
    let met = direction.dot(skyward).abs() > random.next();
    met.then_some((skyward, leaf.1))
}

/// Follows one photon. Depth counts leaf area from the top; candidates for a collision come at unit
/// rate per leaf area and slant, and are real with the probability `|cos(leaf, photon)|`.
fn photon(random: &mut Random) -> Tally {
    let mut tally = Tally::default();
    let mut direction = from_polar(-SUN_MU, TAU * random.next());
    let (mut depth, mut weight, mut scattered) = (0.0, 1.0, false);
    loop {
        let from = depth;
        depth -= -random.next().ln() * direction.z;
        let middle = 0.5 * DEPTH;
        if scattered && (from - middle) * (depth.clamp(0.0, DEPTH) - middle) < 0.0 {
            let bin = ((direction.z.abs() * BINS as f64) as usize).min(BINS - 1);
            tally.middle[usize::from(direction.z < 0.0)][bin] += weight;
        }
        if depth < 0.0 {
            tally.reflected += weight;
            return tally;
        }
        if depth > DEPTH {
            tally.transmitted += weight;
            depth = DEPTH;
            weight *= SOIL;
            direction = lambertian(DVec3::Z, random);
            scattered = true;
        } else if let Some((skyward, lower_face_up)) = meet_leaf(direction, random) {
            let upper_side = if lower_face_up { -skyward } else { skyward };
            let onto_upper = direction.dot(upper_side) < 0.0;
            let (face, lit_side) = if onto_upper {
                (LEAF.upper, upper_side)
            } else {
                (LEAF.lower, -upper_side)
            };
            tally.absorbed += weight * face.absorptance();
            weight *= face.rho + face.tau;
            let back = random.next() * (face.rho + face.tau) < face.rho;
            direction = lambertian(if back { lit_side } else { -lit_side }, random);
            scattered = true;
        }
        // Russian roulette keeps the mean.
        if weight < 0.05 {
            if random.next() > 0.2 {
                return tally;
            }
            weight *= 5.0;
        }
    }
}

#[test]
fn photons_agree() {
    let n = 1_500_000;
    let mut random = Random(7);
    let mut mean = Tally::default();
    for _ in 0..n {
        mean.add(&photon(&mut random), 1.0 / n as f64);
    }
    let bins = 30;
    let layers = homogeneous(4, &LEAVES);
    let field = solve(&layers, LEAF, &[source(SUN_MU, 1.0)], Some(SOIL), bins);
    // Four standard errors of a share, at most 0.5 / sqrt(n) each, and the bins' own error.
    let tolerance = 4.0 * 0.5 / (n as f64).sqrt() + 1e-4;
    close(field.reflected_W_m2, mean.reflected, tolerance);
    close(field.transmitted_W_m2, mean.transmitted, tolerance);
    close(field.absorbed_W_m2.iter().sum(), mean.absorbed, tolerance);
    for bin in 0..BINS {
        let flux = |radiance: &dyn Fn(usize) -> f64| -> f64 {
            let fine = bins / BINS * bin..bins / BINS * (bin + 1);
            let mu = |b: usize| (b as f64 + 0.5) / bins as f64;
            fine.map(|b| radiance(b) * mu(b) * 2.0 * PI / bins as f64)
                .sum()
        };
        close(
            flux(&|b| field.radiance_up(2, b)),
            mean.middle[0][bin],
            tolerance,
        );
        close(
            flux(&|b| field.radiance_down(2, b)),
            mean.middle[1][bin],
            tolerance,
        );
    }
}
