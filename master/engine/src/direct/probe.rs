//! Rays towards a source, from organs that its lattice meets too seldom to say anything of them.

use std::sync::OnceLock;

use glam::DVec3;
use nestrad_common::geometry;
use nestrad_common::light::Source;
use nestrad_kernel::Tracer;
use nestrad_kernel::directions::{Purpose, stream};
use nestrad_kernel::elements::piece_corners;
use rand::RngExt;
use rayon::prelude::*;

use super::areas::Areas;
use crate::frame::Frame;

/// An organ of less area than this many points is probed.
const THIN_POINTS: f64 = 16.0;

/// Rays for an organ, from each source: those of all sources together make its light.
const RAYS: f64 = 8.0;

/// Where all organs and sources together would need more rays than this, none is probed: then there are
/// so many small organs that the lattice is right for all of them together, and its error is stated for
/// each.
const MOST_RAYS: f64 = 2e5;

/// The scene as rays see it.
pub(super) struct Probe {
    /// Made when the first ray is cast: directions that are kept need none.
    tracer: OnceLock<Tracer>,
    seed: u64,
}

/// Which organs are too small for a lattice.
pub(super) struct Thin {
    /// By organ.
    pub(super) organ: Vec<bool>,
    /// Area of each organ, perpendicular to the source, m².
    pub(super) projected_m2: Vec<f64>,
}

impl Thin {
    pub(super) fn of(frame: &Frame, areas: &Areas, towards: DVec3, line_area_m2: f64) -> Self {
        let projected_m2 = areas.projected_organs_m2(frame, towards);
        let is_thin = |(area, projected): (&f64, &f64)| {
            *projected > 0.0 && *area < THIN_POINTS * line_area_m2
        };
        Self {
            organ: areas
                .organ_m2
                .iter()
                .zip(&projected_m2)
                .map(is_thin)
                .collect(),
            projected_m2,
        }
    }

    /// Whether there is any.
    pub(super) fn any(&self) -> bool {
        self.organ.contains(&true)
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.organ.iter().filter(|&&thin| thin).count()
    }

    /// Leaves all of them to the lattice.
    pub(super) fn forget(&mut self) {
        self.organ.fill(false);
    }
}

impl Probe {
    /// For organs that are too small for the lattices of these cross-sections (m², per source), if there
    /// are any; `thin` counts them.
    pub(super) fn new(
        (sources, line_area_m2): (&[Source], &[f64]),
        thin: impl Fn(&Source, f64) -> usize + Sync,
        seed: u64,
    ) -> Option<Self> {
        let thin = |k: usize| thin(&sources[k], line_area_m2[k]);
        let organs: usize = (0..sources.len()).into_par_iter().map(thin).sum();
        let few = organs > 0 && organs as f64 * RAYS <= MOST_RAYS;
        few.then(|| Self {
            tracer: OnceLock::new(),
            seed,
        })
    }

    /// Rays for an element that stands between these parts of its organ, when its elements are laid end to
    /// end: many elements share one.
    pub(super) fn rays_between(from: f64, to: f64) -> u32 {
        let before = |part: f64| (RAYS * part.min(1.0) + 0.5).floor();
        (before(to) - before(from)) as u32
    }

    /// How many of `rays` rays from an element towards source number `source` meet nothing.
    pub(super) fn lit(
        &self,
        frame: &Frame,
        element: usize,
        (source, towards): (usize, DVec3),
        rays: u32,
    ) -> u32 {
        if rays == 0 {
            return 0;
        }
        let t = frame.triangle_of_element[element];
        let (triangle, (piece, divisions)) = frame.piece(element, t);
        let corners = piece_corners(divisions, piece);
        let index = (source as u64 + 1) << 32 | element as u64;
        let mut rng = stream(self.seed, Purpose::Direct, index);
        let tracer = self.tracer.get_or_init(|| Tracer::new(frame.block()));
        let free = (0..rays).filter(|_| {
            let origin = geometry::point_within(&triangle, &corners, [rng.random(), rng.random()]);
            tracer.sees_sky(frame.block(), (t, element as u32), origin, towards)
        });
        free.count() as u32
    }
}
