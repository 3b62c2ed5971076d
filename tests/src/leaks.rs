//! How much is seen through a closed mesh.

use glam::DVec3;
use nestrad_engine::exchange::Sampling;
use nestrad_engine::plan::Estimator;
use nestrad_kernel::ends::Side;

use crate::enclosure::sphere;
use crate::form_factor::Traced;
use crate::solving::sampling;

/// Looks from a closed mesh, and those of them that went through it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Leaks {
    /// Lines or rays.
    pub sent: u64,
    /// What a face saw: twice the segments of lines, or the rays.
    pub looks: u64,
    /// Faces inside that saw something outside, or the other way round.
    pub leaks: u64,
}

/// A sphere of 2048 facets, of radius 1, at an offset; `effort` is the pitch of lines (m) or the number of
/// rays a face.
pub fn of_sphere(offset_m: DVec3, estimator: Estimator, effort: f64, seed: u64) -> Leaks {
    let mut scenery = sphere(4);
    scenery.vertices_m().for_each(|v| *v += offset_m);
    let sampling = Sampling {
        seed,
        ..match estimator {
            Estimator::Lines => sampling(estimator, effort, 0.0),
            Estimator::Rays => sampling(estimator, 1.0, effort),
        }
    };
    // no face is cut: edges of facets are what may leak
    let traced = Traced::new(&scenery.canopy(), 10.0, &sampling);
    let (faces, mut found) = (traced.frame.ends.faces(), Leaks::default());
    for row in 0..faces {
        for half in &traced.exchange.halves {
            for &end in half.row(row as usize) {
                let inside = |face: u32| face < faces && face % 2 == Side::Lower as u32;
                found.looks += 1;
                found.leaks += u64::from(inside(row) != inside(end));
            }
        }
    }
    found.sent = match estimator {
        Estimator::Lines => traced.exchange.counts.lines,
        Estimator::Rays => traced.exchange.counts.rays,
    };
    found
}

/// At the origin, and where a map has the scene.
pub const OFFSETS_M: [DVec3; 2] = [DVec3::ZERO, DVec3::new(5e5, 4.6e6, 2e3)];
