//! How far apart the batches are: the standard errors.
//!
//! Every batch of directions is an estimate of the exchange by itself. With x = s/n the mean over the
//! `n` lines of a row in its half, batch g pulls it away by `r_g = (s_g - x n_g) / n` (the linearised
//! ratio estimator; Cochran 1977, section 2.11), and the variance of a sum over rows is
//! `G/(G-1) sum_g (sum over rows of weight r_g)²` for the G batches of a half. Batches are independent,
//! rows of one batch are not: sums over rows come before squares.

use rayon::prelude::*;

use super::Lane;
use super::sweep::Gather;
use crate::exchange::BatchRows;

/// Elements that are worked off as one task.
const TASK: usize = 512;

/// What one half of the batches makes of every organ and element.
#[derive(Clone, Debug, Default)]
pub(super) struct Spread<const N: usize> {
    /// Variance of absorbed power, W², per element.
    pub(super) element_W2: Vec<Lane<N>>,
    /// Pull of each batch on the absorbed power of each organ, W, indexed `organ * batches + batch`.
    pub(super) organ_W: Vec<Lane<N>>,
}

impl<const N: usize> Gather<'_, N> {
    /// The spread of the batches of a half around `irradiance`, which follows from radiosities `seen`.
    pub(super) fn spread(
        &self,
        batches: &[BatchRows],
        seen: &[Lane<N>],
        organ_of_element: &[u32],
        organs: usize,
    ) -> Spread<N> {
        let elements = organ_of_element.len();
        let tasks: Vec<(Vec<Lane<N>>, Vec<(u32, Vec<Lane<N>>)>)> = (0..elements.div_ceil(TASK))
            .into_par_iter()
            .map(|task| {
                let mut of_elements = Vec::with_capacity(TASK);
                let mut of_organs: Vec<(u32, Vec<Lane<N>>)> = Vec::new();
                let mut pulls = vec![[0.0; N]; batches.len()];
                for element in task * TASK..((task + 1) * TASK).min(elements) {
                    self.pulls(batches, seen, element, &mut pulls);
                    let organ = organ_of_element[element];
                    if of_organs.last().is_none_or(|(o, _)| *o != organ) {
                        of_organs.push((organ, vec![[0.0; N]; batches.len()]));
                    }
                    let mut variance = [0.0; N];
                    if let Some((_, sums)) = of_organs.last_mut() {
                        for (sum, pull) in sums.iter_mut().zip(&pulls) {
                            for b in 0..N {
                                sum[b] += pull[b];
                                variance[b] += pull[b] * pull[b];
                            }
                        }
                    }
                    of_elements.push(variance.map(|v| v * unbias(batches.len())));
                }
                (of_elements, of_organs)
            })
            .collect();
        let mut spread = Spread {
            element_W2: Vec::with_capacity(elements),
            organ_W: vec![[0.0; N]; organs * batches.len()],
        };
        for (of_elements, of_organs) in tasks {
            spread.element_W2.extend(of_elements);
            for (organ, pulls) in of_organs {
                let start = organ as usize * batches.len();
                for (sum, pull) in spread.organ_W[start..].iter_mut().zip(pulls) {
                    for b in 0..N {
                        sum[b] += pull[b];
                    }
                }
            }
        }
        spread
    }

    /// How each batch pulls the power that an element absorbs, W.
    fn pulls(
        &self,
        batches: &[BatchRows],
        seen: &[Lane<N>],
        element: usize,
        pulls: &mut [Lane<N>],
    ) {
        pulls.fill([0.0; N]);
        let buried = self.world.ends.buried();
        for side in 0..2 {
            let row = 2 * element + side;
            let weight = self.absorbing_area_m2(element, side);
            let mut sums = [0.0; N];
            let mut count = 0usize;
            let mut of_batch = Vec::with_capacity(batches.len());
            for batch in batches {
                let ends = batch.row(row);
                let mut sum = [0.0; N];
                let mut counted = 0usize;
                for &end in ends {
                    counted += usize::from(end != buried);
                    for b in 0..N {
                        sum[b] += seen[end as usize][b];
                    }
                }
                for b in 0..N {
                    sums[b] += sum[b];
                }
                count += counted;
                of_batch.push((sum, counted));
            }
            if count == 0 {
                continue;
            }
            let n = count as f64;
            for (pull, (sum, lines)) in pulls.iter_mut().zip(of_batch) {
                for b in 0..N {
                    pull[b] += weight[b] * (sum[b] - sums[b] / n * lines as f64) / n;
                }
            }
        }
    }
}

/// From a mean square over `batches` that share their mean to a variance of that mean.
pub(super) fn unbias(batches: usize) -> f64 {
    let g = batches as f64;
    if batches > 1 { g / (g - 1.0) } else { 0.0 }
}
