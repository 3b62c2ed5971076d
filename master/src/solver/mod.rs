//! Gauss-Seidel over two independent halves of the exchange.
//!
//! With F_A and F_B estimated from two independent halves of the lines, and S the scattering of a face
//! (rho to the same side, tau to the other), the unknowns are the irradiances x and y in
//!
//! ```text
//! x = E0 + F_A S y        y = E0 + F_B S x        E = (x + y) / 2
//! ```
//!
//! Light that goes from i to j and back goes there by one half and back by the other, so a chance
//! excess of lines between i and j is not squared: that removes the bias that one set of lines, used
//! both ways, has in multiple scattering, and every line still serves both its ends. All x depend on y
//! alone and all y on x alone, so a pass is a parallel Gauss-Seidel sweep (a red-black one) with one
//! result for any number of threads. The pair is 2-cyclic and consistently ordered, so Young's theory
//! of over-relaxation applies where its eigenvalues are real (Young 1971; Hageman & Young 1981, chapter
//! 9); see `relaxation` for where they are not.

mod relaxation;
mod spread;
mod sweep;

use nestrad_common::problem::Problem;
use thiserror::Error;

use crate::exchange::{Exchange, Outlook};
use crate::far_field::closure::FarRows;
use crate::world::World;
use spread::Spread;
pub use spread::Variances;
use sweep::Gather;

/// Values per band of a group of `N` bands.
type Lane<const N: usize> = [f64; N];

/// Batches in a half of the exchange.
pub const HALF_BATCHES: usize = 8;

/// When to stop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Tolerance {
    /// What is left to change in the power that each band absorbs, summed over all faces without
    /// regard to sign, relative to the incoming power.
    pub absorbed: f64,
    /// Passes over all rows before the solve is given up.
    pub most_passes: u32,
}

/// Why there is no solution.
#[derive(Debug, Error, PartialEq)]
pub enum SolveError {
    /// The tolerance was not reached.
    #[error(
        "the exchange did not converge in {passes} passes: band {band} may still change by {left:.3e} of its incoming power, expected {wanted:.1e}"
    )]
    NotConverged {
        /// Name of the band.
        band: String,
        /// Passes done.
        passes: u32,
        /// Estimated remaining change.
        left: f64,
        /// Tolerance.
        wanted: f64,
    },
}

/// Irradiances of all rows, in both halves.
#[derive(Clone, Debug, Default)]
pub struct Irradiance {
    /// From the first and from the second half, W m⁻², indexed `row * bands + band`.
    pub halves: [Vec<f64>; 2],
    /// Radiosity (pi times radiance) of the far ends, W m⁻², indexed `far end * bands + band`.
    pub far_W_m2: Vec<f64>,
    /// Bands, as indexed here.
    pub bands: usize,
    /// Passes over all rows that it took.
    pub passes: u32,
    /// Estimated remaining change of absorbed power relative to incoming, per band.
    pub left: Vec<f64>,
    /// What the sampling of the exchange leaves uncertain, per band.
    pub variances: Vec<Variances>,
}

impl Irradiance {
    /// The mean of both halves.
    pub fn mean(&self, row: usize, band: usize) -> f64 {
        let k = row * self.bands + band;
        0.5 * (self.halves[0][k] + self.halves[1][k])
    }
}

/// What is to be solved.
#[derive(Clone, Copy)]
pub struct System<'a> {
    /// Optics and scene.
    pub problem: &'a Problem,
    /// Elements and numbers.
    pub world: &'a World,
    /// What rows see.
    pub exchange: &'a Exchange,
    /// What of it is not a radiosity to solve for.
    pub outlook: &'a Outlook,
    /// What the levels of the far field see, where there is one.
    pub far: Option<&'a FarRows>,
    /// E0, indexed `row * all bands + band`.
    pub direct_W_m2: &'a [f64],
    /// Radiosity of the ends that are not rows (sky, void, outer soil, buried, far field: its start),
    /// indexed `(end - rows) * all bands + band`.
    pub fixed_W_m2: &'a [f64],
    /// Incoming power of all bands, W: what tolerances are relative to.
    pub incoming_W: &'a [f64],
}

impl System<'_> {
    /// Solves for the irradiance of all rows, of the part of them that is not buried, in the bands with
    /// these numbers.
    pub fn solve(&self, bands: &[usize], tolerance: &Tolerance) -> Result<Irradiance, SolveError> {
        let rows = vec![0.0; self.world.rows() * bands.len()];
        let far = vec![0.0; self.world.ends.far_len() as usize * bands.len()];
        let mut all = Irradiance {
            halves: [rows.clone(), rows],
            far_W_m2: far,
            bands: bands.len(),
            passes: 0,
            left: vec![0.0; bands.len()],
            variances: vec![Variances::default(); bands.len()],
        };
        let mut done = 0;
        while done < bands.len() {
            let group = Group {
                system: *self,
                bands: &bands[done..(done + WIDEST).min(bands.len())],
                tolerance,
            };
            match group.bands.len() {
                1 => group.solve::<1>(done, &mut all)?,
                2 => group.solve::<2>(done, &mut all)?,
                3 | 4 => group.solve::<4>(done, &mut all)?,
                _ => group.solve::<WIDEST>(done, &mut all)?,
            }
            done += group.bands.len();
        }
        Ok(all)
    }
}

/// Bands that are solved in one pass over the rows.
const WIDEST: usize = 8;

struct Group<'a> {
    system: System<'a>,
    bands: &'a [usize],
    tolerance: &'a Tolerance,
}

impl Group<'_> {
    fn solve<const N: usize>(&self, first: usize, all: &mut Irradiance) -> Result<(), SolveError> {
        let System {
            problem,
            world,
            outlook,
            far,
            ..
        } = self.system;
        let total = problem.bands.len();
        let lanes = |values: &[f64]| -> Vec<[f64; N]> {
            values
                .chunks_exact(total)
                .map(|v| std::array::from_fn(|k| self.bands.get(k).map_or(0.0, |&b| v[b])))
                .collect()
        };
        let gather = Gather::<N>::new(problem, world, outlook, far, self.bands);
        // an element that is partly buried has its light on the rest of it
        let mut direct = lanes(self.system.direct_W_m2);
        for (lane, &exposed) in direct.iter_mut().zip(&outlook.exposed) {
            *lane = lane.map(|e| if exposed > 0.0 { e / exposed } else { 0.0 });
        }
        let fixed = lanes(self.system.fixed_W_m2);
        let halves = &self.system.exchange.halves;
        let mut x = gather.start(direct.clone(), &fixed);
        let mut y = gather.start(direct.clone(), &fixed);

        let mut relaxation = [relaxation::Relaxation::new(); N];
        let mut left = vec![f64::INFINITY; self.bands.len()];
        let mut passes = 0;
        while passes < self.tolerance.most_passes {
            let omega = relaxation.map(|r| r.omega);
            let from_a = gather.sweep(0, &halves[0], &y, &direct, &omega, &mut x);
            let from_b = gather.sweep(1, &halves[1], &x, &direct, &omega, &mut y);
            passes += 1;
            for (k, left) in left.iter_mut().enumerate() {
                let incoming = self.system.incoming_W[self.bands[k]].max(f64::MIN_POSITIVE);
                *left = relaxation[k].after(0.5 * (from_a[k] + from_b[k]) / incoming);
            }
            if left.iter().all(|&l| l <= self.tolerance.absorbed) {
                break;
            }
        }
        for (k, &l) in left.iter().enumerate() {
            if l > self.tolerance.absorbed || l.is_nan() {
                return Err(SolveError::NotConverged {
                    band: problem.bands[self.bands[k]].name.clone(),
                    passes,
                    left: l,
                    wanted: self.tolerance.absorbed,
                });
            }
            all.left[first + k] = l;
        }
        all.passes = all.passes.max(passes);
        for (half, from) in all.halves.iter_mut().zip([&x, &y]) {
            for (row, lane) in from.irradiance.iter().enumerate() {
                for k in 0..self.bands.len() {
                    half[row * all.bands + first + k] = lane[k];
                }
            }
        }
        let far_start = world.ends.far_start() as usize;
        for (row, (p, q)) in x.radiosity[far_start..]
            .iter()
            .zip(&y.radiosity[far_start..])
            .enumerate()
        {
            for k in 0..self.bands.len() {
                all.far_W_m2[row * all.bands + first + k] = 0.5 * (p[k] + q[k]);
            }
        }
        for (k, &band) in self.bands.iter().enumerate() {
            let spread = Spread {
                system: self.system,
                band,
                halves,
            };
            for (half, seen) in [&y, &x].into_iter().enumerate() {
                let seen: Vec<f64> = seen.radiosity.iter().map(|lane| lane[k]).collect();
                spread.add(half, &seen, &mut all.variances[first + k]);
            }
        }
        Ok(())
    }
}
