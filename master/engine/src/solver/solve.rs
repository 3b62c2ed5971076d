//! Group by group of bands: passes until nothing changes any more, then the errors.

use std::mem::take;

use thiserror::Error;

use super::gather::Gather;
use super::krylov::{Descent, difference};
use super::lane::PULLED_TOGETHER;
use super::pass::Pass;
use super::spread::{Spread, Way};
use super::system::{Irradiance, System, Variances};
use crate::stop::{Stop, Stopped};

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
pub enum SolverError {
    /// The tolerance was not reached.
    #[error(
        "the exchange did not converge in {passes} passes: band {band} may still change by {left:.3e} of its incoming power, expected at most {wanted:.1e}"
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
    Stopped(#[from] Stopped),
}

/// Solves for the irradiance of all rows, of the part of them that is not buried, in the bands with these numbers.
pub fn solve(
    system: &System<'_>,
    bands: &[usize],
    tolerance: &Tolerance,
    stop: &Stop,
) -> Result<Irradiance, SolverError> {
    let rows = vec![0.0; system.frame.rows() * bands.len()];
    let mut all = Irradiance {
        halves: [rows.clone(), rows],
        leaving_W_m2: vec![[0.0; 2]; bands.len()],
        bands: bands.len(),
        passes: 0,
        left: vec![0.0; bands.len()],
        variances: vec![Variances::default(); bands.len()],
        of_element_size: Vec::new(),
        of_soil_cells: Default::default(),
        of_far_field: Vec::new(),
    };
    let mut done = 0;
    while done < bands.len() {
        let group = Group {
            system: *system,
            bands: &bands[done..(done + WIDEST).min(bands.len())],
            tolerance,
            stop,
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

/// Bands that are solved in one pass over the rows.
const WIDEST: usize = 8;

struct Group<'a> {
    system: System<'a>,
    bands: &'a [usize],
    tolerance: &'a Tolerance,
    stop: &'a Stop,
}

impl Group<'_> {
    fn solve<const N: usize>(&self, first: usize, all: &mut Irradiance) -> Result<(), SolverError> {
        let optics = self.system.optics;
        let gather = Gather::<N>::new(&self.system, self.bands);
        let mut pass = Pass::new(&self.system, &gather, self.bands);
        let left = self.converge(&mut pass)?;
        for (k, &l) in left[..self.bands.len()].iter().enumerate() {
            if l > self.tolerance.absorbed || l.is_nan() {
                return Err(SolverError::NotConverged {
                    band: optics.bands[self.bands[k]].name.clone(),
                    passes: pass.done,
                    left: l,
                    wanted: self.tolerance.absorbed,
                });
            }
            all.left[first + k] = l;
        }
        all.passes = all.passes.max(pass.done);
        self.take(&pass, first, all);
        all.of_element_size.extend(pass.of_element_size());
        for (all, way) in all.of_soil_cells.iter_mut().zip(pass.of_soil_cells()) {
            all.extend(way);
        }
        if let Some(sample) = &self.system.far_sample {
            all.of_far_field.extend(pass.of_far_field(sample));
        }
        // what follows takes the most memory of a solve, and needs radiosities alone
        let mut radiosities = pass.into_radiosities();
        let mut way = Way::default();
        for pair in (0..self.bands.len()).step_by(PULLED_TOGETHER) {
            let bands = &self.bands[pair..(pair + PULLED_TOGETHER).min(self.bands.len())];
            let variances = &mut all.variances[first + pair..first + pair + bands.len()];
            let spread = Spread {
                system: self.system,
                bands,
            };
            let of = |lane: [f64; N]| {
                std::array::from_fn(|k| lane.get(pair + k).copied().unwrap_or(0.0))
            };
            let is_last = pair + PULLED_TOGETHER >= self.bands.len();
            let radiosity = radiosities.each_mut().map(|half| -> Vec<_> {
                if is_last {
                    // two bands stay where they are
                    take(half).into_iter().map(of).collect()
                } else {
                    half.iter().copied().map(of).collect()
                }
            });
            for half in 0..2 {
                self.stop.check()?;
                spread.add(half, &radiosity, &mut way, variances);
            }
        }
        Ok(())
    }

    /// Passes until what is left to change in the absorbed power is below the tolerance, or there have been
    /// too many; returns what is left, relative to what comes in, and leaves the solution in `pass`.
    fn converge<const N: usize>(&self, pass: &mut Pass<N>) -> Result<[f64; N], Stopped> {
        let System { frame, outlook, .. } = self.system;
        let gather = pass.gather;
        let weight: Vec<f64> = (0..frame.rows())
            .map(|row| frame.row_area_m2(row) * outlook.exposed[row])
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
            self.stop.check()?;
            pass.with_light(&y);
            let residual = difference(&pass.y.irradiance, &y);
            let left = times(size(&residual), behind);
            if reached(&left, self.tolerance.absorbed) || pass.done >= self.tolerance.most_passes {
                return Ok(left);
            }
            let mut descent = Descent::new(&weight, residual);
            // a pass more checks what the steps have come to
            while pass.done + 1 < self.tolerance.most_passes {
                self.stop.check()?;
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
                    // where hardly any light comes, the iterate may be below 0 by a rounding
                    half[row * all.bands + first + k] = lane[k].max(0.0);
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
