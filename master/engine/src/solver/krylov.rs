//! Gauss-Seidel as the preconditioner of a minimal-residual method.
//!
//! A pass takes y to `K y + c`, with `K = F_B S F_A S`; what is wanted is `(1 - K) y = c`. Plain passes
//! leave the share of light that is still on its way after so many scatterings, which in a deep canopy that
//! absorbs next to nothing is nearly all of it. The generalised conjugate residual method (Eisenstat, Elman &
//! Schultz 1983), truncated to a few directions as in ORTHOMIN (Vinsome 1976), needs one pass a step, too,
//! and takes the step that leaves the least residual: it cannot diverge. By reciprocity `1 - K` is nearly
//! self-adjoint in the inner product that weighs a row by its area, so a few directions do as well as all.

use std::collections::VecDeque;

use rayon::prelude::*;

use super::sums::{TASK, sum_of};

/// Directions that are kept.
const KEPT: usize = 4;

/// Steps over which the error of an earlier iterate is known from the later ones.
const DELAY: usize = 2;

type Field<const N: usize> = Vec<[f64; N]>;

/// A residual that is brought down step by step, for `N` bands at once.
pub(super) struct Descent<'a, const N: usize> {
    /// Weight of each row in the inner product.
    weight: &'a [f64],
    residual: Field<N>,
    directions: VecDeque<Direction<N>>,
    /// Norms of the last residuals, and sizes of the last steps, the latest one last.
    norms: VecDeque<[f64; N]>,
    steps: VecDeque<[f64; N]>,
}

struct Direction<const N: usize> {
    p: Field<N>,
    /// `(1 - K) p`.
    q: Field<N>,
    qq: [f64; N],
}

impl<'a, const N: usize> Descent<'a, N> {
    pub(super) fn new(weight: &'a [f64], residual: Field<N>) -> Self {
        let norm = dot(weight, &residual, &residual).map(f64::sqrt);
        Self {
            weight,
            residual,
            directions: VecDeque::new(),
            norms: VecDeque::from([norm]),
            steps: VecDeque::new(),
        }
    }

    pub(super) fn residual(&self) -> &[[f64; N]] {
        &self.residual
    }

    /// Takes a step from `y`; `pass` is K, `size` measures a step.
    pub(super) fn step(
        &mut self,
        y: &mut [[f64; N]],
        pass: impl FnOnce(&[[f64; N]]) -> Field<N>,
        size: impl FnOnce(&[[f64; N]]) -> [f64; N],
    ) {
        if self.directions.len() == KEPT {
            self.directions.pop_front();
        }
        let mut p = self.residual.clone();
        let mut q = pass(&p);
        update(&mut q, &p, |q, p| p - q);
        for old in &self.directions {
            let beta = ratio(dot(self.weight, &q, &old.q), old.qq);
            add(&mut p, beta.map(|b| -b), &old.p);
            add(&mut q, beta.map(|b| -b), &old.q);
        }
        let qq = dot(self.weight, &q, &q);
        let alpha = ratio(dot(self.weight, &self.residual, &q), qq);
        add(y, alpha, &p);
        add(&mut self.residual, alpha.map(|a| -a), &q);

        let norm = dot(self.weight, &self.residual, &self.residual).map(f64::sqrt);
        let of_p = size(&p);
        keep(&mut self.norms, norm, DELAY + 1);
        keep(
            &mut self.steps,
            std::array::from_fn(|k| alpha[k].abs() * of_p[k]),
            DELAY,
        );
        self.directions.push_back(Direction { p, q, qq });
    }

    /// What may be left to go, in the measure of the steps; infinite as long as that is not known.
    ///
    /// The error of the iterate before the last steps is about the sum of these (Golub & Meurant 2010,
    /// chapter 12), and has since come down as the residual has: for steps that shrink geometrically this
    /// is the sum of all to come.
    pub(super) fn left(&self) -> [f64; N] {
        std::array::from_fn(|k| {
            let (first, last) = (self.norms[0][k], self.norms[self.norms.len() - 1][k]);
            let taken: f64 = self.steps.iter().map(|s| s[k]).sum();
            if last == 0.0 {
                0.0
            } else if self.steps.len() < DELAY || last >= first {
                f64::INFINITY
            } else {
                let rate = last / first;
                taken * rate / (1.0 - rate)
            }
        })
    }
}

fn keep<T>(list: &mut VecDeque<T>, item: T, most: usize) {
    list.push_back(item);
    if list.len() > most {
        list.pop_front();
    }
}

/// A quotient; a band that has nothing left to solve takes no steps.
fn ratio<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    std::array::from_fn(|k| if b[k] > 0.0 { a[k] / b[k] } else { 0.0 })
}

fn update<const N: usize>(
    to: &mut [[f64; N]],
    from: &[[f64; N]],
    each: impl Fn(f64, f64) -> f64 + Sync,
) {
    to.par_chunks_mut(TASK)
        .zip(from.par_chunks(TASK))
        .for_each(|(to, from)| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = std::array::from_fn(|k| each(to[k], from[k]));
            }
        });
}

fn add<const N: usize>(to: &mut [[f64; N]], factor: [f64; N], from: &[[f64; N]]) {
    to.par_chunks_mut(TASK)
        .zip(from.par_chunks(TASK))
        .for_each(|(to, from)| {
            for (to, from) in to.iter_mut().zip(from) {
                for k in 0..N {
                    to[k] += factor[k] * from[k];
                }
            }
        });
}

/// The difference of two fields.
pub(super) fn difference<const N: usize>(a: &[[f64; N]], b: &[[f64; N]]) -> Field<N> {
    let mut difference = a.to_vec();
    update(&mut difference, b, |a, b| a - b);
    difference
}

/// Inner product with weights, summed in a fixed order.
fn dot<const N: usize>(weight: &[f64], a: &[[f64; N]], b: &[[f64; N]]) -> [f64; N] {
    let parts: Vec<[f64; N]> = weight
        .par_chunks(TASK)
        .zip(a.par_chunks(TASK).zip(b.par_chunks(TASK)))
        .map(|(weight, (a, b))| {
            let mut sum = [0.0; N];
            for (w, (a, b)) in weight.iter().zip(a.iter().zip(b)) {
                for k in 0..N {
                    sum[k] += w * a[k] * b[k];
                }
            }
            sum
        })
        .collect();
    sum_of(&parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Diffusion along a chain that absorbs nothing but at its ends: eigenvalues up to `cos(pi / (n + 1))`.
    fn pass(y: &[[f64; 1]]) -> Field<1> {
        let at = |k: Option<usize>| k.and_then(|k| y.get(k)).map_or(0.0, |v| v[0]);
        (0..y.len())
            .map(|k| [0.5 * (at(k.checked_sub(1)) + at(Some(k + 1)))])
            .collect()
    }

    #[test]
    fn slow_diffusion_is_solved_and_what_is_left_is_known() {
        let n = 60;
        // y = 1 everywhere
        let mut rhs = vec![[0.0]; n];
        (rhs[0], rhs[n - 1]) = ([0.5], [0.5]);
        let weight = vec![1.0; n];
        let mut y = vec![[0.0]; n];
        let mut descent = Descent::new(&weight, rhs);
        let size = |v: &[[f64; 1]]| [v.iter().map(|x| x[0].abs()).sum()];
        let mut steps = 0;
        while descent.left()[0] > 1e-8 {
            descent.step(&mut y, pass, size);
            steps += 1;
            assert!(steps <= 60, "plain passes need 13,000");
        }
        let off: f64 = y.iter().map(|v| (v[0] - 1.0).abs()).sum();
        assert!(off < 1e-7, "{off:e} after {steps} steps");
    }

    #[test]
    fn nothing_to_solve_is_no_step() {
        let mut y = vec![[1.0, 2.0]; 3];
        let weight = [1.0; 3];
        let mut descent = Descent::new(&weight, vec![[0.0, 0.0]; 3]);
        descent.step(&mut y, |p| p.to_vec(), |_| [0.0; 2]);
        assert_eq!(y, vec![[1.0, 2.0]; 3]);
        assert_eq!(descent.left(), [0.0; 2]);
    }
}
