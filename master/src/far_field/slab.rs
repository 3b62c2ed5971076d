//! A homogeneous slab as a black box: what goes in, what comes out.
//!
//! A slab thin enough for a rational approximation is doubled until it is the layer (Grant & Hunt
//! 1969; Wiscombe 1976). Light is counted as flux through a horizontal plane, so that energy is a
//! plain sum over bins; all entries are shares of light, none is negative.

use super::beam::BeamResponse;
use super::matrix::{Lu, Matrix, sum};
use super::medium::LayerOptics;

/// Largest 1-norm of the interaction matrix of a slab that is computed without doubling:
/// its optical depth, at most twice as much. Errors are then below 1e-13 (measured).
const START_NORM: f64 = 0.125;

/// Denominator coefficients of the (3, 3) Padé approximant of `exp`; the numerator's are the same
/// without the signs.
pub(super) const PADE: [f64; 4] = [1.0, -1.0 / 2.0, 1.0 / 10.0, -1.0 / 120.0];

/// Reflection, transmission and absorption of light that enters, and the fate of the beams.
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
    /// Per unit of their flux at the top of the slab.
    pub(super) beams: BeamResponse,
}

impl Slab {
    /// The whole layer.
    pub(super) fn of_layer(layer: &LayerOptics) -> Self {
        let norm = norm(&layer.interaction);
        let mut doublings = 0;
        let mut thickness = 1.0;
        while norm * thickness > START_NORM {
            doublings += 1;
            thickness *= 0.5;
        }
        let mut slab = Self::thin(layer, thickness);
        for _ in 0..doublings {
            slab = slab.doubled();
        }
        slab
    }

    /// A slab of `thickness` times the layer, the norm of its interaction at most [`START_NORM`].
    ///
    /// The notation is that of `docs/far_field.md`, "The thin slab": `z` is the interaction times
    /// the thickness, `jz` the same with the sign of upward rows changed, `d` what comes out less
    /// what goes in.
    fn thin(layer: &LayerOptics, thickness: f64) -> Self {
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
        Self {
            reflect_top: d.block(m, 0, m, m),
            transmit_down: Matrix::identity(m).plus(&d.block(0, 0, m, m)),
            reflect_bottom: d.block(0, m, m, m),
            transmit_up: Matrix::identity(m).plus(&d.block(m, m, m, m)),
            absorb_top: absorb[..m].to_vec(),
            absorb_bottom: absorb[m..].to_vec(),
            beams: BeamResponse::thin(layer, thickness, &jz, &system),
        }
    }

    /// Two of these slabs, one on the other.
    fn doubled(self) -> Self {
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
        Self {
            reflect_top: up.times(&coming_back).plus(top),
            transmit_down: down.times(&going_down),
            reflect_bottom: down.times(&turned_down).plus(bottom),
            transmit_up: up.times(&going_up),
            absorb_top: absorbed(&self.absorb_top, &going_down, &coming_back),
            absorb_bottom: absorbed(&self.absorb_bottom, &turned_down, &going_up),
            beams: self.beams.doubled(&self, &rounds_down),
        }
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

/// The largest column sum of absolute values.
fn norm(matrix: &Matrix) -> f64 {
    let mut sums = vec![0.0; matrix.cols()];
    for i in 0..matrix.rows() {
        for (sum, x) in sums.iter_mut().zip(matrix.row(i)) {
            *sum += x.abs();
        }
    }
    sums.into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use nestrad_common::optics::{Band, FaceOptics, LeafOptics};

    use super::super::layers::{Foliage, Layers};
    use super::super::leaf::Bins;
    use super::super::medium::{Beams, Medium};
    use super::*;

    const BINS: Bins = Bins(5);

    /// A layer of tilted leaves.
    fn slab(leaf: LeafOptics, lower_face_up: bool, area_index: f64) -> Slab {
        let foliage = [(0, 0.4), (1, 0.6)].map(|(class, share)| Foliage {
            class,
            material: 0,
            lower_face_up,
            area_index: share * area_index,
        });
        let layers = Layers {
            bottom_z_m: 0.0,
            top_z_m: 1.0,
            ground_area_m2: 1.0,
            class_cosine: vec![0.9, 0.25],
            foliage: vec![foliage.to_vec()],
        };
        let band = Band {
            name: "test".into(),
            soil_albedo: 0.0,
            materials: vec![leaf],
        };
        let beams = Beams::new(&[], 0);
        let medium = Medium::new(&layers, BINS, &band, &beams);
        let layer = medium.layer(&layers.foliage[0]);
        Slab::of_layer(&layer.expect("there are leaves"))
    }

    fn near(a: &Matrix, b: &Matrix, tolerance: f64) {
        for i in 0..a.rows() {
            for (x, y) in a.row(i).iter().zip(b.row(i)) {
                assert!((x - y).abs() < tolerance, "{x} {y}");
            }
        }
    }

    fn face(rho: f64, tau: f64) -> FaceOptics {
        FaceOptics { rho, tau }
    }

    #[test]
    fn leaves_turned_over_make_the_mirror_image() {
        let leaf = LeafOptics {
            upper: face(0.6, 0.1),
            lower: face(0.2, 0.5),
        };
        for area_index in [0.01, 3.0, 40.0] {
            let (a, b) = (slab(leaf, false, area_index), slab(leaf, true, area_index));
            near(&a.reflect_top, &b.reflect_bottom, 1e-13);
            near(&a.transmit_down, &b.transmit_up, 1e-13);
        }
    }

    /// In an enclosure of one temperature radiance is the same everywhere: leaves that absorb
    /// nothing and obey reciprocity (equal tau on both faces) must not disturb it.
    #[test]
    fn isotropic_light_stays_so_among_leaves_that_absorb_nothing() {
        let slab = slab(LeafOptics::symmetric(0.7, 0.3), false, 3.0);
        let isotropic: Vec<f64> = (0..BINS.0).map(|b| BINS.mu(b)).collect();
        let up = sum(
            &slab.reflect_top.times_column(&isotropic),
            &slab.transmit_up.times_column(&isotropic),
        );
        for (out, wanted) in up.iter().zip(&isotropic) {
            assert!((out - wanted).abs() < 1e-13);
        }
    }

    #[test]
    fn light_can_be_sent_back_the_way_it_came() {
        let leaf = LeafOptics {
            upper: face(0.6, 0.3),
            lower: face(0.2, 0.3),
        };
        let slab = slab(leaf, false, 2.0);
        for a in 0..BINS.0 {
            for b in 0..BINS.0 {
                let ratio = BINS.mu(a) / BINS.mu(b);
                let there = slab.reflect_top.row(a)[b];
                let back = slab.reflect_top.row(b)[a];
                assert!((there - ratio * back).abs() < 1e-13);
                let there = slab.transmit_down.row(a)[b];
                let back = slab.transmit_up.row(b)[a];
                assert!((there - ratio * back).abs() < 1e-13);
            }
        }
    }
}
