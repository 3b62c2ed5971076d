//! A layer as a slab with its beams: computed thin, then doubled to its thickness.

use super::beam::BeamResponse;
use super::matrix::Matrix;
use super::medium::LayerOptics;
use super::slab::Slab;

/// Largest 1-norm of the interaction matrix of a slab that is computed without doubling:
/// its optical depth, at most twice as much. Errors are then below 1e-13 (measured).
const START_NORM: f64 = 0.125;

/// A slab, and the fate of the beams in it.
pub(super) struct LayerSlab {
    pub(super) slab: Slab,
    /// Per unit of their flux at the top of the slab.
    pub(super) beams: BeamResponse,
}

impl LayerSlab {
    /// The whole layer.
    pub(super) fn of_layer(layer: &LayerOptics) -> Self {
        let norm = norm(&layer.interaction);
        let mut doublings = 0;
        let mut thickness = 1.0;
        while norm * thickness > START_NORM {
            doublings += 1;
            thickness *= 0.5;
        }
        let (mut slab, thin) = Slab::thin(layer, thickness);
        let mut beams = BeamResponse::thin(layer, thickness, &thin);
        for _ in 0..doublings {
            let (twice, rounds_down) = slab.doubled();
            beams = beams.doubled(&slab, &rounds_down);
            slab = twice;
        }
        Self { slab, beams }
    }
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
    use super::super::matrix::sum;
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
        LayerSlab::of_layer(&layer.expect("there are leaves")).slab
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
