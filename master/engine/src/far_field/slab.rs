//! A homogeneous slab as a black box: what goes in, what comes out.
//!
//! A slab thin enough for a rational approximation is doubled until it is the layer (Grant & Hunt
//! 1969; Wiscombe 1976). Light is counted as flux through a horizontal plane, so that energy is a
//! plain sum over bins; all entries are shares of light, none is negative.

use super::matrix::{Lu, Matrix, sum};
use super::medium::LayerOptics;

/// Denominator coefficients of the (3, 3) Padé approximant of `exp`; the numerator's are the same
/// without the signs.
pub(super) const PADE: [f64; 4] = [1.0, -1.0 / 2.0, 1.0 / 10.0, -1.0 / 120.0];

/// Reflection, transmission and absorption of light that enters.
pub(super) struct Slab {
    /// From above, back up.
    pub(super) reflect_top: Matrix,
    /// From above, on down.
    pub(super) transmit_down: Matrix,
    /// From below, back down.
    pub(super) reflect_bottom: Matrix,
    /// From below, on up.
    pub(super) transmit_up: Matrix,
    /// Absorbed share of each bin's light from above.
    pub(super) absorb_top: Vec<f64>,
    /// Absorbed share of each bin's light from below.
    pub(super) absorb_bottom: Vec<f64>,
}

/// What a thin slab is computed from, which its beams share.
pub(super) struct Thin {
    /// The interaction times the thickness, with the sign of upward rows changed.
    pub(super) jz: Matrix,
    /// The left side of the equations.
    pub(super) system: Lu,
}

impl Slab {
    /// A slab of `thickness` times the layer, the norm of its interaction at most an eighth.
    ///
    /// The notation is that of `docs/far_field.md`, "The thin slab": `z` is the interaction times
    /// the thickness, `jz` the same with the sign of upward rows changed, `d` what comes out less
    /// what goes in.
    pub(super) fn thin(layer: &LayerOptics, thickness: f64) -> (Self, Thin) {
        let n = layer.interaction.rows();
        let m = n / 2;
        let mut z = Matrix::zeros(n, n);
        z.add_scaled(thickness, &layer.interaction);
        let jz = z.clone().negate_rows(m);
        let zjz = z.times(&jz);
        let cube = zjz.times(&jz);

        let mut system = Matrix::identity(n);
        system.add_scaled(PADE[1], &z);
        system.add_scaled(PADE[2], &zjz.negate_cols(m));
        system.add_scaled(PADE[3], &cube);
        let system = Lu::of_dominant(system);
        let mut right = z;
        right.add_scaled(-2.0 * PADE[3], &cube);
        let d = system.solve(right);

        let absorption: Vec<f64> = layer.absorption.iter().map(|a| a * thickness).collect();
        let absorb = thin_absorption(&absorption, &jz, &d);
        let slab = Self {
            reflect_top: d.block(m, 0, m, m),
            transmit_down: Matrix::identity(m).plus(&d.block(0, 0, m, m)),
            reflect_bottom: d.block(0, m, m, m),
            transmit_up: Matrix::identity(m).plus(&d.block(m, m, m, m)),
            absorb_top: absorb[..m].to_vec(),
            absorb_bottom: absorb[m..].to_vec(),
        };
        (slab, Thin { jz, system })
    }

    /// Two of these slabs, one on the other, and what sums up the rounds of downward light between them.
    pub(super) fn doubled(&self) -> (Self, Lu) {
        let (top, bottom) = (&self.reflect_top, &self.reflect_bottom);
        let (down, up) = (&self.transmit_down, &self.transmit_up);

        // Light on its way down between the two slabs: what the lower one sends back and the upper
        // one sends back again goes another round, the rest is lost to the round.
        let lost_below = self.lost_from_above();
        let lost_above = self.lost_from_below();
        let rounds_down = Lu::of_rounds(
            bottom.times(top),
            sum(&lost_below, &top.row_times(&lost_above)),
        );
        let going_down = rounds_down.solve(down.clone());
        let coming_back = top.times(&going_down);

        // The mirror image: light from below.
        let rounds_up = Lu::of_rounds(
            top.times(bottom),
            sum(&lost_above, &bottom.row_times(&lost_below)),
        );
        let going_up = rounds_up.solve(up.clone());
        let turned_down = bottom.times(&going_up);

        let absorbed = |entering: &[f64], down: &Matrix, up: &Matrix| {
            let between = sum(
                &down.row_times(&self.absorb_top),
                &up.row_times(&self.absorb_bottom),
            );
            sum(entering, &between)
        };
        let slab = Self {
            reflect_top: up.times(&coming_back).plus(top),
            transmit_down: down.times(&going_down),
            reflect_bottom: down.times(&turned_down).plus(bottom),
            transmit_up: up.times(&going_up),
            absorb_top: absorbed(&self.absorb_top, &going_down, &coming_back),
            absorb_bottom: absorbed(&self.absorb_bottom, &turned_down, &going_up),
        };
        (slab, rounds_down)
    }

    /// Share of each bin's light from above that does not come back.
    pub(super) fn lost_from_above(&self) -> Vec<f64> {
        sum(&self.transmit_down.column_sums(), &self.absorb_top)
    }

    /// Share of each bin's light from below that does not come back.
    pub(super) fn lost_from_below(&self) -> Vec<f64> {
        sum(&self.transmit_up.column_sums(), &self.absorb_bottom)
    }
}

/// Absorbed share of the light that enters a thin slab: by its own equation, not as what is missing
/// from the rest, so that it is exact where little or nothing is absorbed.
fn thin_absorption(absorption: &[f64], jz: &Matrix, d: &Matrix) -> Vec<f64> {
    let m = jz.rows() / 2;
    let mut first = jz.row_times(absorption);
    let second = jz.row_times(&first);
    first[m..].iter_mut().for_each(|x| *x = -*x);
    let on_change: Vec<f64> = (0..2 * m)
        .map(|ch| -PADE[1] * absorption[ch] - PADE[2] * first[ch] - PADE[3] * second[ch])
        .collect();
    let change = d.row_times(&on_change);
    (0..2 * m)
        .map(|ch| (absorption[ch] - 2.0 * PADE[3] * second[ch] + change[ch]).max(0.0))
        .collect()
}
