//! Standard errors, from how far the batches of directions lie apart.
//!
//! Every batch is an estimate of the exchange by itself. With m the mean of what the n lines of a row
//! in its half see, and s_g, n_g the sum and number of those of batch g, the batch pulls the row's
//! irradiance by `r_g = (s_g - m n_g) / n` (linearised ratio estimator; Cochran 1977, section 2.11).
//! The pull is then sent through the exchange, as light of its own, so that what it does to all other
//! faces counts too: `dx = r_g + F_A S dy`, `dy = F_B S dx` (the delta method). Batches are independent,
//! so the variance of anything linear in the irradiances is
//! `G / (G - 1) sum_g (its change)²` over the G batches of each half.

use rayon::prelude::*;

use super::sweep::Gather;
use super::{HALF_BATCHES, Lane, System};
use crate::exchange::HalfRows;
use crate::far_field::closure::flux_weight;
use crate::world;

type Pull = Lane<HALF_BATCHES>;

/// Variances of one band.
#[derive(Clone, Debug, Default)]
pub struct Variances {
    /// Of the power that each triangle absorbs, W².
    pub triangle_W2: Vec<f64>,
    /// Of the power that each organ absorbs, W².
    pub organ_W2: Vec<f64>,
    /// Of the irradiance of each soil cell, (W m⁻²)².
    pub soil_W2_m4: Vec<f64>,
    /// Of the power that plants absorb, that soil absorbs, that leaves upwards and downwards, and of
    /// what is missing in their sum, W².
    pub balance_W2: [f64; 5],
}

/// A band's batches in one half, around the solution.
pub(super) struct Spread<'a> {
    pub(super) system: System<'a>,
    /// Number of the band.
    pub(super) band: usize,
    /// The halves of the exchange.
    pub(super) halves: &'a [HalfRows; 2],
}

/// What a pull does to irradiances and to the radiosities of the far ends.
struct Change {
    irradiance: Vec<Pull>,
    far: Vec<Pull>,
}

/// What of a pull is still on its way when it is no longer followed, in parts of the pull.
const FOLLOWED: f64 = 0.03;

/// Half passes that a pull is followed for at most.
const MOST_STEPS: usize = 12;

impl Spread<'_> {
    /// Adds the variances that the batches of a half leave to `sum`. `seen`: radiosity, in this band,
    /// of what that half looks at.
    pub(super) fn add(&self, half: usize, seen: &[f64], sum: &mut Variances) {
        let pulls = self.pulls(half, seen);
        let change = self.followed(half, pulls);
        self.collect(&change, sum);
    }

    /// How each batch of a half pulls the irradiance of each row.
    fn pulls(&self, half: usize, seen: &[f64]) -> Vec<Pull> {
        let buried = self.system.world.ends.buried();
        let rows = &self.halves[half];
        let weights = &self.system.outlook.weight[half];
        (0..self.system.world.rows())
            .into_par_iter()
            .with_min_len(1024)
            .map(|row| {
                let (mut sums, mut counts) = ([0.0; HALF_BATCHES], [0usize; HALF_BATCHES]);
                for (g, entries) in rows.by_batch(row).enumerate() {
                    for &end in entries {
                        sums[g] += seen[end as usize];
                        counts[g] += usize::from(end != buried);
                    }
                }
                let mean = sums.iter().sum::<f64>() * weights[row];
                std::array::from_fn(|g| (sums[g] - mean * counts[g] as f64) * weights[row])
            })
            .collect()
    }

    /// The change of the result, the mean of both halves, that pulls on one half bring about.
    fn followed(&self, half: usize, pulls: Vec<Pull>) -> Change {
        let System {
            problem,
            world,
            outlook,
            far,
            ..
        } = self.system;
        let gather =
            Gather::<HALF_BATCHES>::new(problem, world, outlook, far, &[self.band; HALF_BATCHES]);
        let dark =
            vec![[0.0; HALF_BATCHES]; self.system.world.ends.len() - self.system.world.rows()];
        let none = vec![[0.0; HALF_BATCHES]; self.system.world.rows()];
        let first = gather.absorbed(&pulls);
        let mut pulled = gather.start(pulls.clone(), &dark);
        let mut other = gather.start(none.clone(), &dark);
        for step in 0..MOST_STEPS {
            let omega = [1.0; HALF_BATCHES];
            let change = if step % 2 == 0 {
                gather.sweep(
                    1 - half,
                    &self.halves[1 - half],
                    &pulled,
                    &none,
                    &omega,
                    &mut other,
                )
            } else {
                gather.sweep(
                    half,
                    &self.halves[half],
                    &other,
                    &pulls,
                    &omega,
                    &mut pulled,
                )
            };
            if (0..HALF_BATCHES).all(|g| change[g] <= FOLLOWED * first[g]) {
                break;
            }
        }
        let mean = |a: &[Pull], b: &[Pull]| {
            a.iter()
                .zip(b)
                .map(|(a, b)| std::array::from_fn(|g| 0.5 * (a[g] + b[g])))
                .collect()
        };
        let far_start = world.ends.far_start() as usize;
        Change {
            irradiance: mean(&pulled.irradiance, &other.irradiance),
            far: mean(
                &pulled.radiosity[far_start..],
                &other.radiosity[far_start..],
            ),
        }
    }

    fn collect(&self, change: &Change, sum: &mut Variances) {
        let Change {
            irradiance: change,
            far,
        } = change;
        let (scene, elements) = (&self.system.problem.scene, self.system.world.elements.len());
        let band = &self.system.problem.bands[self.band];
        let soil_triangle = world::is_soil(scene);
        sum.triangle_W2.resize(scene.triangles.len(), 0.0);
        sum.soil_W2_m4
            .resize(self.system.world.rows() - 2 * elements, 0.0);
        sum.organ_W2.resize(scene.organs.len(), 0.0);
        let mut organs = vec![[0.0; HALF_BATCHES]; scene.organs.len()];
        let mut balance = [[0.0; HALF_BATCHES]; 4];
        for (t, first) in self.system.world.elements.first.windows(2).enumerate() {
            let optics = band.materials[scene.material[t] as usize];
            let faces = [optics.upper, optics.lower];
            let mut absorbed = [0.0; HALF_BATCHES];
            for row in 2 * first[0] as usize..2 * first[1] as usize {
                let (face, opposite) = (faces[row % 2], faces[1 - row % 2]);
                let area = self.exposed_area_m2(row);
                add(&mut absorbed, face.absorptance() * area, &change[row]);
                self.escape(&mut balance, row, face.rho * area, &change[row]);
                self.escape(&mut balance, row, opposite.tau * area, &change[row ^ 1]);
            }
            add(&mut organs[scene.organ[t] as usize], 1.0, &absorbed);
            add(&mut balance[usize::from(soil_triangle[t])], 1.0, &absorbed);
            sum.triangle_W2[t] += variance(&absorbed);
        }
        for (cell, pull) in change[2 * elements..].iter().enumerate() {
            let row = 2 * elements + cell;
            let area = self.exposed_area_m2(row);
            add(&mut balance[1], (1.0 - band.soil_albedo) * area, pull);
            self.escape(&mut balance, row, band.soil_albedo * area, pull);
            sum.soil_W2_m4[cell] += variance(pull);
        }
        if !far.is_empty() {
            // what leaves the scene crosses its top and bottom levels
            let (world, ends) = (self.system.world, &self.system.world.ends);
            (balance[2], balance[3]) = ([0.0; HALF_BATCHES], [0.0; HALF_BATCHES]);
            for bin in 0..ends.far_bins {
                let weight = world.ground_area_m2() * flux_weight(bin, ends.far_bins);
                let at = |end: u32| &far[(end - ends.far_start()) as usize];
                add(
                    &mut balance[2],
                    weight,
                    at(ends.far_from_below(bin, ends.far_levels - 1)),
                );
                if world.soil.is_none() {
                    add(&mut balance[3], weight, at(ends.far_from_above(bin, 0)));
                }
            }
        }
        for (sum, organ) in sum.organ_W2.iter_mut().zip(&organs) {
            *sum += variance(organ);
        }
        let mut closure = [0.0; HALF_BATCHES];
        for (k, part) in balance.iter().enumerate() {
            sum.balance_W2[k] += variance(part);
            add(&mut closure, 1.0, part);
        }
        sum.balance_W2[4] += variance(&closure);
    }

    fn exposed_area_m2(&self, row: usize) -> f64 {
        self.system.world.row_area_m2(row as u32) * self.system.outlook.exposed[row]
    }

    fn escape(&self, balance: &mut [Pull; 4], row: usize, weight: f64, change: &Pull) {
        let outlook = self.system.outlook;
        let part = |of: &[Vec<f64>; 2]| 0.5 * (of[0][row] + of[1][row]);
        add(&mut balance[2], weight * part(&outlook.to_sky), change);
        add(&mut balance[3], weight * part(&outlook.to_void), change);
    }
}

impl<const N: usize> Gather<'_, N> {
    /// Power that irradiances make all faces absorb, summed without regard to sign, W.
    fn absorbed(&self, irradiance: &[Lane<N>]) -> Lane<N> {
        let mut sum = [0.0; N];
        for (row, lane) in irradiance[..self.world.ends.faces() as usize]
            .iter()
            .enumerate()
        {
            let area = self.counted_area_m2(row / 2, row % 2);
            for k in 0..N {
                sum[k] += area[k] * lane[k].abs();
            }
        }
        sum
    }
}

fn add(to: &mut Pull, weight: f64, change: &Pull) {
    for (to, change) in to.iter_mut().zip(change) {
        *to += weight * change;
    }
}

fn variance(change: &Pull) -> f64 {
    let batches = HALF_BATCHES as f64;
    batches / (batches - 1.0) * change.iter().map(|c| c * c).sum::<f64>()
}
