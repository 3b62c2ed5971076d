//! Directions of the parallel lines: uniform in solid angle, well spread, in independent batches.

use glam::{DQuat, DVec3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

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
    /// Rays from sensors.
    Sensors = 6,
}

/// A direction of lines, and its share of the hemisphere relative to the mean of its set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted {
    /// Unit vector, `z > 0`.
    pub direction: DVec3,
    /// Solid angle that it stands for, over that of an equal share.
    pub weight: f64,
}

/// `sets` sets of axes, each turned at random by itself: the 6 axes through the vertices of an
/// icosahedron, the 10 of a dodecahedron, or all 16 of both.
///
/// Each axis by itself is uniform over the hemisphere, so any sum over them is unbiased. As a set they
/// integrate all spherical harmonics up to degree 5 (6 or 10 axes) or 9 (16 axes, with weights 25 and
/// 27; McLaren 1963) exactly: so the projected area of a face, whatever its inclination, hardly varies
/// from set to set.
pub fn axes(kind: Axes, sets: u32, rng: &mut Pcg64Mcg) -> Vec<Weighted> {
    (0..sets)
        .flat_map(|_| {
            let turn = random_rotation(rng);
            kind.axes().into_iter().map(move |(axis, weight)| {
                let d = turn * axis.normalize();
                let d = if d.z < 0.0 { -d } else { d };
                // never exactly horizontal
                let direction = DVec3::new(d.x, d.y, d.z.max(1e-9)).normalize();
                Weighted { direction, weight }
            })
        })
        .collect()
}

/// Which axes make a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub enum Axes {
    /// 6 axes.
    Icosahedron,
    /// 10 axes.
    Dodecahedron,
    /// 16 axes.
    Both,
}

impl Axes {
    /// Number of axes in a set.
    pub fn count(self) -> u32 {
        match self {
            Self::Icosahedron => 6,
            Self::Dodecahedron => 10,
            Self::Both => 16,
        }
    }

    fn axes(self) -> Vec<(DVec3, f64)> {
        let golden = 0.5 * (1.0 + 5.0f64.sqrt());
        let cyclic = |v: DVec3| [v, DVec3::new(v.z, v.x, v.y), DVec3::new(v.y, v.z, v.x)];
        let pair = |a: f64, b: f64| [DVec3::new(0.0, a, b), DVec3::new(0.0, -a, b)];
        let six = pair(1.0, golden).into_iter().flat_map(cyclic);
        let cube = [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
            .map(|(x, y)| DVec3::new(x, y, 1.0));
        let ten = cube
            .into_iter()
            .chain(pair(golden, 1.0 / golden).into_iter().flat_map(cyclic));
        // 6 * 25/26.25 + 10 * 27/26.25 = 16
        const MEAN: f64 = (6.0 * 25.0 + 10.0 * 27.0) / 16.0;
        match self {
            Self::Icosahedron => six.map(|a| (a, 1.0)).collect(),
            Self::Dodecahedron => ten.map(|a| (a, 1.0)).collect(),
            Self::Both => six
                .map(|a| (a, 25.0 / MEAN))
                .chain(ten.map(|a| (a, 27.0 / MEAN)))
                .collect(),
        }
    }
}

/// A rotation uniform over all rotations (Shoemake 1992).
fn random_rotation(rng: &mut Pcg64Mcg) -> DQuat {
    let (u, a, b): (f64, f64, f64) = (rng.random(), rng.random(), rng.random());
    let (a, b) = (std::f64::consts::TAU * a, std::f64::consts::TAU * b);
    let (r, s) = ((1.0 - u).sqrt(), u.sqrt());
    DQuat::from_xyzw(r * a.sin(), r * a.cos(), s * b.sin(), s * b.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean over the axes of a Legendre polynomial of the cosine to `normal`; 0 when exact.
    fn harmonic(axes: &[Weighted], normal: DVec3, degree: u32) -> f64 {
        let legendre = |x: f64| {
            (1..degree)
                .fold((1.0, x), |(p0, p1), n| {
                    let n = f64::from(n);
                    (p1, ((2.0 * n + 1.0) * x * p1 - n * p0) / (n + 1.0))
                })
                .1
        };
        axes.iter()
            .map(|a| a.weight * legendre(a.direction.dot(normal)))
            .sum::<f64>()
            / axes.len() as f64
    }

    #[test]
    fn a_set_integrates_low_harmonics_exactly() {
        for (kind, exact, next) in [
            (Axes::Icosahedron, 4, 6),
            (Axes::Dodecahedron, 4, 6),
            (Axes::Both, 8, 10),
        ] {
            let set = axes(kind, 1, &mut stream(3, Purpose::Lines, 0));
            assert_eq!(set.len() as u32, kind.count());
            assert!((set.iter().map(|a| a.weight).sum::<f64>() - set.len() as f64).abs() < 1e-12);
            let normal = DVec3::new(0.3, -0.5, 0.7).normalize();
            for degree in (2..=exact).step_by(2) {
                assert!(
                    harmonic(&set, normal, degree).abs() < 1e-12,
                    "{kind:?} {degree}"
                );
            }
            assert!(harmonic(&set, normal, next).abs() > 1e-3);
        }
    }

    #[test]
    fn axes_are_uniform_over_the_hemisphere() {
        let all = axes(Axes::Icosahedron, 4000, &mut stream(7, Purpose::Lines, 0));
        let mut slices = [0u32; 10];
        for a in &all {
            assert!((a.direction.length() - 1.0).abs() < 1e-12 && a.direction.z > 0.0);
            slices[(a.direction.z * 10.0) as usize] += 1;
        }
        assert!(
            slices
                .iter()
                .all(|&n| (f64::from(n) / 2400.0 - 1.0).abs() < 0.1),
            "{slices:?}"
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
