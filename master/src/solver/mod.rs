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
//! result for any number of threads. Passes are accelerated by a minimal-residual method (`krylov`), so
//! that a canopy that absorbs next to nothing converges, too.

mod deviation;
mod gather;
mod groups;
mod krylov;
mod lane;
mod pass;
mod prefetch;
mod spread;

use nestrad_common::problem::Problem;
use thiserror::Error;

use crate::exchange::{Exchange, Outlook};
use crate::far_field::closure::FarRows;
use crate::output::progress::Cancelled;
use crate::world::World;
pub use deviation::{Deviation, FarSample};
use gather::Gather;
use groups::Groups;
use krylov::{Descent, difference};
use lane::PULLED_TOGETHER;
use pass::Pass;
pub use spread::Variances;
use spread::{Spread, Way};

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
    /// It is not wanted any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Asked before each pass whether to go on.
pub type Step<'a> = &'a dyn Fn() -> Result<(), Cancelled>;

/// Irradiances of all rows, in both halves.
#[derive(Clone, Debug, Default)]
pub struct Irradiance {
    /// From the first and from the second half, W m⁻², indexed `row * bands + band`.
    pub halves: [Vec<f64>; 2],
    /// What leaves upwards and downwards through the far field, W per m² of ground, per band.
    pub leaving_W_m2: Vec<[f64; 2]>,
    /// Bands, as indexed here.
    pub bands: usize,
    /// Passes over all rows that it took.
    pub passes: u32,
    /// Estimated remaining change of absorbed power relative to incoming, per band.
    pub left: Vec<f64>,
    /// What the sampling of the exchange leaves uncertain, per band.
    pub variances: Vec<Variances>,
    /// What the size of elements may do, per band.
    pub of_element_size: Vec<Deviation>,
    /// What the mean field beyond the sphere does, per band, where there is one.
    pub of_far_field: Vec<Deviation>,
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
    /// What the far field is the mean of, where there is one.
    pub far: Option<&'a FarRows>,
    /// E0, indexed `row * all bands + band`.
    pub direct_W_m2: &'a [f64],
    /// Radiosity of the ends that are not rows (sky, void, outer soil, buried, far field: its start),
    /// indexed `(end - rows) * all bands + band`.
    pub fixed_W_m2: &'a [f64],
    /// Incoming power of all bands, W: what tolerances are relative to.
    pub incoming_W: &'a [f64],
    /// What the far field is judged by, where there is one.
    pub far_sample: Option<&'a FarSample>,
}

impl System<'_> {
    /// Solves for the irradiance of all rows, of the part of them that is not buried, in the bands with
    /// these numbers.
    pub fn solve(
        &self,
        bands: &[usize],
        tolerance: &Tolerance,
        step: Step,
    ) -> Result<Irradiance, SolveError> {
        let rows = vec![0.0; self.world.rows() * bands.len()];
        let mut all = Irradiance {
            halves: [rows.clone(), rows],
            leaving_W_m2: vec![[0.0; 2]; bands.len()],
            bands: bands.len(),
            passes: 0,
            left: vec![0.0; bands.len()],
            variances: vec![Variances::default(); bands.len()],
            of_element_size: Vec::new(),
            of_far_field: Vec::new(),
        };
        let groups = Groups::of(self.problem, self.world);
        let mut done = 0;
        while done < bands.len() {
            let group = Group {
                system: *self,
                bands: &bands[done..(done + WIDEST).min(bands.len())],
                tolerance,
                groups: &groups,
                step,
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
    groups: &'a Groups,
    step: Step<'a>,
}

impl Group<'_> {
    fn solve<const N: usize>(&self, first: usize, all: &mut Irradiance) -> Result<(), SolveError> {
        let problem = self.system.problem;
        let gather = Gather::<N>::new(&self.system, self.bands);
        let mut pass = Pass::new(&self.system, &gather, self.bands);
        let left = self.converge(&mut pass)?;
        for (k, &l) in left[..self.bands.len()].iter().enumerate() {
            if l > self.tolerance.absorbed || l.is_nan() {
                return Err(SolveError::NotConverged {
                    band: problem.bands[self.bands[k]].name.clone(),
                    passes: pass.done,
                    left: l,
                    wanted: self.tolerance.absorbed,
                });
            }
            all.left[first + k] = l;
        }
        all.passes = all.passes.max(pass.done);
        self.take(&pass, first, all);
        all.of_element_size
            .extend(pass.of_element_size(self, self.groups));
        if let Some(sample) = self.system.far_sample {
            all.of_far_field.extend(pass.of_far_field(self, sample));
        }
        let mut way = Way::default();
        for pair in (0..self.bands.len()).step_by(PULLED_TOGETHER) {
            let bands = &self.bands[pair..(pair + PULLED_TOGETHER).min(self.bands.len())];
            let variances = &mut all.variances[first + pair..first + pair + bands.len()];
            let spread = Spread {
                system: self.system,
                bands,
            };
            let radiosity = [&pass.x, &pass.y].map(|half| -> Vec<_> {
                let of = |lane: &[f64; N]| {
                    std::array::from_fn(|k| lane.get(pair + k).copied().unwrap_or(0.0))
                };
                half.radiosity.iter().map(of).collect()
            });
            for half in 0..2 {
                (self.step)()?;
                spread.add(half, &radiosity, &mut way, variances);
            }
        }
        Ok(())
    }

    /// Passes until what is left to change in the absorbed power is below the tolerance, or there have been
    /// too many; returns what is left, relative to what comes in, and leaves the solution in `pass`.
    fn converge<const N: usize>(&self, pass: &mut Pass<N>) -> Result<[f64; N], Cancelled> {
        let System { world, outlook, .. } = self.system;
        let gather = pass.gather;
        let weight: Vec<f64> = (0..world.rows())
            .map(|row| world.row_area_m2(row as u32) * outlook.exposed[row])
            .collect();
        let size = |field: &[[f64; N]]| -> [f64; N] {
            let absorbed = gather.absorbed(field);
            std::array::from_fn(|k| match self.bands.get(k) {
                Some(&b) => absorbed[k] / self.system.incoming_W[b].max(f64::MIN_POSITIVE),
                None => 0.0,
            })
        };
        let reached = |left: &[f64; N], wanted: f64| left.iter().all(|&l| l <= wanted);
        let mut y = pass.first();
        // what is left to go for each unit of change in a plain pass
        let mut behind = [f64::INFINITY; N];
        loop {
            (self.step)()?;
            pass.with_light(&y);
            let residual = difference(&pass.y.irradiance, &y);
            let left = times(size(&residual), behind);
            if reached(&left, self.tolerance.absorbed) || pass.done >= self.tolerance.most_passes {
                return Ok(left);
            }
            let mut descent = Descent::new(&weight, residual);
            // a pass more checks what the steps have come to
            while pass.done + 1 < self.tolerance.most_passes {
                (self.step)()?;
                descent.step(&mut y, |p| pass.scattering(p), size);
                let (left, change) = (descent.left(), size(descent.residual()));
                behind = std::array::from_fn(|k| match change[k] {
                    0.0 => 1.0,
                    c => (left[k] / c).max(1.0),
                });
                if reached(&left, 0.5 * self.tolerance.absorbed) {
                    break;
                }
            }
        }
    }

    /// Takes the solution over.
    fn take<const N: usize>(&self, pass: &Pass<N>, first: usize, all: &mut Irradiance) {
        for (half, from) in all.halves.iter_mut().zip([&pass.x, &pass.y]) {
            for (row, lane) in from.irradiance.iter().enumerate() {
                for k in 0..self.bands.len() {
                    half[row * all.bands + first + k] = lane[k];
                }
            }
        }
        for (half, from) in [&pass.x, &pass.y].into_iter().enumerate() {
            let leaving = pass.gather.leaving(half, &from.radiosity);
            for k in 0..self.bands.len() {
                for (sum, way) in all.leaving_W_m2[first + k].iter_mut().zip(leaving) {
                    *sum += 0.5 * way[k];
                }
            }
        }
    }
}

/// Products; nothing is nothing, however often.
fn times<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    std::array::from_fn(|k| if a[k] == 0.0 { 0.0 } else { a[k] * b[k] })
}
