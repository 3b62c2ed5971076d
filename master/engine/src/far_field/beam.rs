//! What a slab makes of light that comes straight from the sources.
//!
//! Beams are extinguished exponentially and what they leave in the slab is its internal source;
//! doubling with such sources: Wiscombe 1976.

use super::matrix::{Lu, Matrix, sum};
use super::medium::LayerOptics;
use super::slab::{PADE, Slab, Thin};

/// Highest power of the interaction in the series of a beam's source; the next one is below the
/// start's own error.
const SOURCE_POWERS: usize = 7;

/// Fate of each beam's light, per unit of its flux at the top of the slab.
pub(super) struct BeamResponse {
    /// Optical depth of the slab for each beam.
    pub(super) depth: Vec<f64>,
    /// Scattered flux that leaves at the top; rows are bins, columns beams.
    pub(super) emit_up: Matrix,
    /// Scattered flux that leaves at the bottom.
    pub(super) emit_down: Matrix,
    /// Absorbed, at once or after scattering.
    pub(super) absorbed: Vec<f64>,
}

impl BeamResponse {
    /// The start: the beam's source decays exponentially through the slab, however steeply, and
    /// what it sends out is followed with a power series in the slab's thickness.
    pub(super) fn thin(layer: &LayerOptics, thickness: f64, thin: &Thin) -> Self {
        let Thin { jz, system } = thin;
        let m = jz.rows() / 2;
        let depth: Vec<f64> = layer.beam_depth.iter().map(|d| d * thickness).collect();
        let moments: Vec<_> = depth.iter().map(|&x| source_moments(x)).collect();
        let source = layer.beam_scatter.clone().negate_rows(m);
        // Horner's rule for the sum over j of coefficient(j) (jz)^j source.
        let mut series = Matrix::zeros(jz.rows(), depth.len());
        for power in (0..=SOURCE_POWERS).rev() {
            let coefficient = |moments: &[f64; SOURCE_POWERS + 1]| {
                let terms = PADE.iter().zip(moments[..=power].iter().rev());
                terms.map(|(pade, moment)| pade * moment).sum()
            };
            let coefficients: Vec<f64> = moments.iter().map(coefficient).collect();
            let mut term = source.clone();
            term.scale_columns(&coefficients);
            series = jz.times(&series).plus(&term);
        }
        let emitted = system.solve(series.negate_rows(m));

        let scattered = layer.beam_scatter.column_sums();
        let escaped = emitted.column_sums();
        let absorbed = (0..depth.len()).map(|s| {
            let met = moments[s][0];
            met * layer.beam_absorption[s] + (met * scattered[s] - escaped[s]).max(0.0)
        });
        Self {
            absorbed: absorbed.collect(),
            emit_down: emitted.block(0, 0, m, depth.len()),
            emit_up: emitted.block(m, 0, m, depth.len()),
            depth,
        }
    }

    /// Two of these slabs, one on the other; `rounds_down` sums up what downward light does between
    /// them.
    pub(super) fn doubled(&self, slab: &Slab, rounds_down: &Lu) -> Self {
        let passed: Vec<f64> = self.depth.iter().map(|x| (-x).exp()).collect();
        let dimmed = |emitted: &Matrix| {
            let mut emitted = emitted.clone();
            emitted.scale_columns(&passed);
            emitted
        };
        let (below_up, below_down) = (dimmed(&self.emit_up), dimmed(&self.emit_down));
        // Downward and upward light between the two slabs.
        let down = slab.reflect_bottom.times(&below_up).plus(&self.emit_down);
        let down = rounds_down.solve(down);
        let up = slab.reflect_top.times(&down).plus(&below_up);
        let caught = sum(
            &down.row_times(&slab.absorb_top),
            &up.row_times(&slab.absorb_bottom),
        );
        let own = self.absorbed.iter().zip(&passed);
        let own: Vec<f64> = own.map(|(a, passed)| a * (1.0 + passed)).collect();
        Self {
            emit_up: slab.transmit_up.times(&up).plus(&self.emit_up),
            emit_down: slab.transmit_down.times(&down).plus(&below_down),
            absorbed: sum(&own, &caught),
            depth: self.depth.iter().map(|x| 2.0 * x).collect(),
        }
    }
}

/// `x phi_k(-x)` for `k = 1, 2, ...`, where `phi_k` are the functions of exponential integrators
/// (Hochbruck & Ostermann 2010): the moments, over a slab, of what a beam leaves in it when `x`, not
/// negative, is the slab's optical depth for the beam.
fn source_moments(x: f64) -> [f64; SOURCE_POWERS + 1] {
    let mut inverse_factorial = [1.0; SOURCE_POWERS + 2];
    for k in 1..inverse_factorial.len() {
        inverse_factorial[k] = inverse_factorial[k - 1] / k as f64;
    }
    let mut moments = [0.0; SOURCE_POWERS + 1];
    if x < 1.0 {
        // phi_k = 1/k! - x phi_(k+1), downwards, which is stable here; the last from its series.
        let last = SOURCE_POWERS + 1;
        let mut term = inverse_factorial[last];
        let mut phi = 0.0;
        let mut j = last;
        while phi + term != phi {
            phi += term;
            j += 1;
            term *= -x / j as f64;
        }
        for k in (1..=last).rev() {
            moments[k - 1] = x * phi;
            phi = inverse_factorial[k - 1] - x * phi;
        }
    } else {
        moments[0] = -(-x).exp_m1();
        for k in 1..=SOURCE_POWERS {
            moments[k] = inverse_factorial[k] - moments[k - 1] / x;
        }
    }
    moments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_a_beam_agree_with_quadrature_and_at_the_seam() {
        for x in [1e-9, 0.3, 0.999_999, 1.0, 7.0, 1e6] {
            let moments = source_moments(x);
            // phi_k(-x) is the mean of exp(-x (1 - s)) s^(k-1) / (k-1)! over s from 0 to 1; the
            // substitution y = exp(-x (1 - s)) takes the exponential out of it.
            let n = 100_000;
            let mut factorial = 1.0;
            for (k, &moment) in moments.iter().enumerate() {
                let integral: f64 = (0..n)
                    .map(|i| (f64::from(i) + 0.5) / f64::from(n))
                    .map(|u| {
                        let s: f64 = 1.0 + (1.0 + u * (-x).exp_m1()).ln() / x;
                        s.powi(k as i32)
                    })
                    .sum::<f64>()
                    * -(-x).exp_m1()
                    / f64::from(n)
                    / factorial;
                let tolerance = 1e-6 * integral.abs() + 1e-12;
                assert!((moment - integral).abs() < tolerance, "{x} {k}");
                factorial *= (k + 1) as f64;
            }
        }
    }
}
