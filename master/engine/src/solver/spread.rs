//! Standard errors, from how far the batches of directions lie apart.
//!
//! Every batch is an estimate of the exchange by itself. With m the mean of what the n lines of a row
//! in its half see, and s_g, n_g the sum and number of those of batch g, the batch pulls the row's
//! irradiance by `r_g = (s_g - m n_g) / n` (linearised ratio estimator; Cochran 1977, section 2.11).
//! The pull is then sent through the exchange, as light of its own, so that what it does to all other
//! faces counts too: `dx = r_g + F_A S dy`, `dy = F_B S dx` (the delta method). Batches are independent,
//! so the variance of anything linear in the irradiances is
//! `G / (G - 1) sum_g (its change)²` over the G batches of each half.
//!
//! The far field is a mean over lines of its own, in as many batches: those pull the radiosities of the far
//! ends, and what leaves, in the same way. Batch g of the exchange and batch g of the far field are
//! independent, so they are followed as one: the square of their sum is the sum of their squares on average.

use nestrad_kernel::far_grid::Exit;
use rayon::prelude::*;

use super::gather::{Gather, Half};
use super::lane::{Lane, PULLED_TOGETHER, PULLS, Pull};
use super::prefetch::prefetch;
use super::system::{System, Variances};
use crate::exchange::{HALF_BATCHES, HalfRows};
use crate::sinks::{SINKS, Sink};

/// A number for each batch.
type PerBatch = [f64; HALF_BATCHES];

/// The batches of the exchange, around the solution in a few bands.
pub(super) struct Spread<'a> {
    pub(super) system: System<'a>,
    /// Numbers of the bands.
    pub(super) bands: &'a [usize],
}

/// How batches pull the radiosities of far ends, and what leaves upwards and downwards through the far field.
struct FarPulls {
    ends: Vec<Pull>,
    leaving: [Pull; 2],
}

/// Pulls on their way. Kept from half to half: of a large scene it is hundreds of MB, which the system has to
/// clear each time that they are new.
#[derive(Default)]
pub(super) struct Way {
    /// How batches pull the irradiances of rows.
    rows: Vec<Pull>,
    /// What they do to the half that they pull on.
    pulled: Half<Pull>,
    /// And to the other.
    other: Half<Pull>,
}

/// What of a pull is still on its way when it is no longer followed, in parts of the pull.
const FOLLOWED: f64 = 0.03;

/// Half passes that a pull is followed for at most.
const MOST_STEPS: usize = 12;

/// A number for each band.
type PerBand = [f64; PULLED_TOGETHER];

impl Spread<'_> {
    /// Adds the variances that the batches of a half leave to `sums`, one per band. `radiosity` of all ends
    /// in both halves, in these bands: a half's rows look at those of the other, its far field at its own.
    pub(super) fn add(
        &self,
        half: usize,
        radiosity: &[Vec<PerBand>; 2],
        way: &mut Way,
        sums: &mut [Variances],
    ) {
        let unit = units(&radiosity[1 - half]);
        let far = self.far_pulls(half, &radiosity[half], unit);
        self.pulls(half, &radiosity[1 - half], unit, &mut way.rows);
        let leaving = self.follow(half, &far, way);
        for (k, sum) in sums.iter_mut().enumerate() {
            self.collect(&way.pulled.irradiance, &leaving, (k, unit[k]), sum);
        }
    }

    /// How each batch of a half pulls the irradiance of each row, in units of `unit`.
    fn pulls(&self, half: usize, seen: &[PerBand], unit: PerBand, into: &mut Vec<Pull>) {
        let buried = self.system.frame.ends.buried();
        let rows = &self.system.exchange.halves[half];
        let weights = &self.system.outlook.weight[half];
        (0..self.system.frame.rows())
            .into_par_iter()
            .with_min_len(1024)
            .map(|row| {
                let counted = |end| end != buried;
                pull(rows, row, counted, weights[row], (seen, unit))
            })
            .collect_into_vec(into);
    }

    /// How each batch of a half of the far field pulls the radiosities of the far ends, and what leaves.
    fn far_pulls(&self, half: usize, near: &[PerBand], unit: PerBand) -> FarPulls {
        let Some(far) = self.system.far else {
            return FarPulls {
                ends: Vec::new(),
                leaving: [Pull::NONE; 2],
            };
        };
        let (rows, ends) = (&far.halves[half], self.system.frame.ends.far_ends as usize);
        let of = |row: usize| {
            let weight = 1.0 / rows.row(row).len().max(1) as f64;
            pull(rows, row, |_| true, weight, (near, unit))
        };
        let down = if self.system.frame.world.soil.is_some() {
            Pull::NONE
        } else {
            of(far.leaving(Exit::Down))
        };
        FarPulls {
            ends: (0..ends).into_par_iter().map(of).collect(),
            leaving: [of(far.leaving(Exit::Up)), down],
        }
    }

    /// Makes of pulls on one half the change that they bring about of the result, the mean of both halves, in
    /// place of the irradiances of the half; returns that of what leaves through the far field.
    fn follow(&self, half: usize, far_pulls: &FarPulls, way: &mut Way) -> [Pull; 2] {
        let Way {
            rows,
            pulled,
            other,
        } = way;
        let frame = self.system.frame;
        let lanes: Vec<usize> = self
            .bands
            .iter()
            .flat_map(|&band| [band; HALF_BATCHES])
            .collect();
        let gather = Gather::<PULLS>::new(&self.system, &lanes);
        let halves = &self.system.exchange.halves;
        let dark = vec![Pull::NONE; frame.ends.len() - frame.rows()];
        let first = gather.absorbed(rows);
        let pull_far = |radiosity: &mut [Pull]| {
            let far = &mut radiosity[frame.ends.far(0) as usize..];
            for (radiosity, pull) in far.iter_mut().zip(&far_pulls.ends) {
                *radiosity = sum(radiosity, pull);
            }
        };
        pulled.irradiance.clone_from(rows);
        gather.start(pulled, &dark);
        gather.close_far_field(half, &mut pulled.radiosity);
        pull_far(&mut pulled.radiosity);
        other.irradiance.clear();
        other.irradiance.resize(frame.rows(), Pull::NONE);
        gather.start(other, &dark);
        for step in 0..MOST_STEPS {
            let change = if step % 2 == 0 {
                gather.half_pass(1 - half, &halves[1 - half], pulled, None, other)
            } else {
                let change = gather.half_pass(half, &halves[half], other, Some(rows), pulled);
                pull_far(&mut pulled.radiosity);
                change
            };
            if (0..PULLS).all(|g| change[g] <= FOLLOWED * first[g]) {
                break;
            }
        }
        let mean = |a: [f64; PULLS], b: [f64; PULLS]| {
            Pull::of(std::array::from_fn(|g| 0.5 * (a[g] + b[g])))
        };
        let leaving = [
            gather.leaving(half, &pulled.radiosity),
            gather.leaving(1 - half, &other.radiosity),
        ];
        pulled
            .irradiance
            .par_iter_mut()
            .zip(&other.irradiance)
            .for_each(|(a, b)| *a = mean(a.get(), b.get()));
        [0, 1].map(|way: usize| {
            let through = mean(leaving[0][way], leaving[1][way]);
            // what pulls one half's mean pulls half as much on that of both
            let own = far_pulls.leaving[way].get().map(|p| 0.5 * p);
            sum(&through, &Pull::of(own))
        })
    }

    /// Adds the variances in band `k` of the group, whose changes are in units of `unit`.
    fn collect(
        &self,
        irradiance: &[Pull],
        leaving: &[Pull; 2],
        (k, unit): (usize, f64),
        sum: &mut Variances,
    ) {
        let pull = |of: &Pull| of.of_band(k).map(|x| x * unit);
        let at = |row: usize| pull(&irradiance[row]);
        let (frame, elements) = (self.system.frame, self.system.frame.area_m2.len());
        let band = &self.system.optics.bands[self.bands[k]];
        sum.triangle_W2.resize(frame.organ.len(), 0.0);
        sum.soil_W2_m4.resize(frame.rows() - 2 * elements, 0.0);
        sum.organ_W2.resize(frame.organs, 0.0);
        let mut organs = vec![[0.0; HALF_BATCHES]; frame.organs];
        let mut balance = [[0.0; HALF_BATCHES]; SINKS];
        let mut materials = vec![[0.0; HALF_BATCHES]; frame.kinds.len()];
        for (t, first) in frame.elements().first.windows(2).enumerate() {
            let optics = band.materials[frame.material[t] as usize];
            let faces = [optics.upper, optics.lower];
            let mut absorbed = [0.0; HALF_BATCHES];
            for row in 2 * first[0] as usize..2 * first[1] as usize {
                let (face, opposite) = (faces[row % 2], faces[1 - row % 2]);
                let area = self.exposed_area_m2(row);
                add(&mut absorbed, face.absorptance() * area, &at(row));
                self.escape(&mut balance, row, face.rho * area, &at(row));
                self.escape(&mut balance, row, opposite.tau * area, &at(row ^ 1));
            }
            add(&mut organs[frame.organ[t] as usize], 1.0, &absorbed);
            for &sink in Sink::of(frame.kind(t)) {
                add(&mut balance[sink as usize], 1.0, &absorbed);
            }
            add(&mut materials[frame.material[t] as usize], 1.0, &absorbed);
            sum.triangle_W2[t] += variance(&absorbed);
        }
        for row in 2 * elements..irradiance.len() {
            let (cell, pull) = (row - 2 * elements, at(row));
            let area = self.exposed_area_m2(row);
            let absorbed = (1.0 - band.soil_albedo) * area;
            add(&mut balance[Sink::Soil as usize], absorbed, &pull);
            self.escape(&mut balance, row, band.soil_albedo * area, &pull);
            sum.soil_W2_m4[cell] += variance(&pull);
        }
        if self.system.far.is_some() {
            let ground_m2 = frame.world.ground_area_m2();
            for (sink, leaving) in [Sink::Up, Sink::Down].into_iter().zip(leaving) {
                balance[sink as usize] = pull(leaving).map(|x| ground_m2 * x);
            }
        }
        for (sum, organ) in sum.organ_W2.iter_mut().zip(&organs) {
            *sum += variance(organ);
        }
        sum.material_W2.resize(materials.len(), 0.0);
        for (sum, material) in sum.material_W2.iter_mut().zip(&materials) {
            *sum += variance(material);
        }
        for (sum, part) in sum.sinks_W2.iter_mut().zip(&balance) {
            *sum += variance(part);
        }
        let mut closure = [0.0; HALF_BATCHES];
        for sink in Sink::WHOLE {
            add(&mut closure, 1.0, &balance[sink as usize]);
        }
        sum.closure_W2 += variance(&closure);
    }

    fn exposed_area_m2(&self, row: usize) -> f64 {
        self.system.frame.row_area_m2(row) * self.system.outlook.exposed[row]
    }

    fn escape(&self, balance: &mut [PerBatch; SINKS], row: usize, weight: f64, change: &PerBatch) {
        let outlook = self.system.outlook;
        let part = |of: &dyn Fn(usize) -> f64| 0.5 * (of(0) + of(1));
        let to_sky = part(&|half| outlook.to_sky[half][row]);
        let to_void = part(&|half| outlook.to_void(half, row));
        add(&mut balance[Sink::Up as usize], weight * to_sky, change);
        add(&mut balance[Sink::Down as usize], weight * to_void, change);
    }
}

/// How batches pull the mean over what a row sees, of which those ends that are not `counted` are dark and not
/// in the mean; `weight` is one over the number of the others.
fn pull(
    rows: &HalfRows,
    row: usize,
    counted: impl Fn(u32) -> bool,
    weight: f64,
    (seen, unit): (&[PerBand], PerBand),
) -> Pull {
    let ends = rows.ends();
    let mut sums = [[0.0; HALF_BATCHES]; PULLED_TOGETHER];
    let mut counts = [0usize; HALF_BATCHES];
    for (g, range) in rows.by_batch(row).enumerate() {
        for i in range {
            prefetch(seen, ends, i);
            let end = ends[i];
            for (sums, seen) in sums.iter_mut().zip(&seen[end as usize]) {
                sums[g] += seen;
            }
            counts[g] += usize::from(counted(end));
        }
    }
    let mean = sums.map(|s| s.iter().sum::<f64>() * weight);
    Pull::of(std::array::from_fn(|n| {
        let (k, g) = (n / HALF_BATCHES, n % HALF_BATCHES);
        (sums[k][g] - mean[k] * counts[g] as f64) * weight / unit[k]
    }))
}

fn sum(a: &Pull, b: &Pull) -> Pull {
    let (a, b) = (a.get(), b.get());
    Pull::of(std::array::from_fn(|g| a[g] + b[g]))
}

/// A power of two near the largest radiosity in each band: in such units f32 neither overflows nor
/// vanishes, and a light that is twice as strong has the very same errors, doubled.
fn units(seen: &[PerBand]) -> PerBand {
    let largest = seen
        .iter()
        .fold([0.0f64; PULLED_TOGETHER], |largest, seen| {
            std::array::from_fn(|k| largest[k].max(seen[k].abs()))
        });
    largest.map(|l| {
        if l > 0.0 {
            l.log2().floor().exp2()
        } else {
            1.0
        }
    })
}

fn add(to: &mut PerBatch, weight: f64, change: &PerBatch) {
    for (to, change) in to.iter_mut().zip(change) {
        *to += weight * change;
    }
}

fn variance(change: &PerBatch) -> f64 {
    let batches = HALF_BATCHES as f64;
    batches / (batches - 1.0) * change.iter().map(|c| c * c).sum::<f64>()
}
