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

/// Rays for all organs and sources together. They go to the strongest sources first: a sun has them for itself, and
/// the many directions of a sky have none where they do not suffice for all of them. What has none is left to the
/// lattice, whose error is stated for each organ.
const MOST_RAYS: f64 = 2e5;

/// A source is probed where the rays suffice for all that shine with this part of its strength or more.
const ALIKE: f64 = 0.5;

/// The scene as rays see it.
pub(super) struct Probe<'a> {
    /// Made when the first ray is cast: directions that are kept need none.
    tracer: &'a OnceLock<Tracer>,
    seed: u64,
    /// Whether rays go to each source.
    of_source: Vec<bool>,
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

impl<'a> Probe<'a> {
    /// For organs that are too small for the lattices of these cross-sections (m², per source); `thin` counts them.
    pub(super) fn new(
        (sources, line_area_m2): (&[Source], &[f64]),
        thin: impl Fn(&Source, f64) -> usize + Sync,
        (tracer, seed): (&'a OnceLock<Tracer>, u64),
    ) -> Self {
        let thin = |k: usize| thin(&sources[k], line_area_m2[k]);
        let organs: Vec<usize> = (0..sources.len()).into_par_iter().map(thin).collect();
        let strength: Vec<f64> = sources.iter().map(Source::intensity_W_m2).collect();
        Self {
            tracer,
            seed,
            of_source: strongest_first(&strength, &organs),
        }
    }

    /// Whether small organs are probed towards source number `source`.
    pub(super) fn serves(&self, source: usize) -> bool {
        self.of_source[source]
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

/// Which sources have rays, by their strength and the organs that are too small for the lattice of each.
fn strongest_first(strength: &[f64], organs: &[usize]) -> Vec<bool> {
    let mut order: Vec<usize> = (0..strength.len()).collect();
    order.sort_by(|&a, &b| strength[b].total_cmp(&strength[a]));
    let mut served = vec![false; strength.len()];
    let (mut rays, mut counted) = (0.0, 0);
    for &k in &order {
        while let Some(&next) = order.get(counted)
            && strength[next] >= ALIKE * strength[k]
        {
            rays += organs[next] as f64 * RAYS;
            counted += 1;
        }
        if rays > MOST_RAYS {
            break;
        }
        served[k] = organs[k] > 0;
    }
    served
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Leaf tips were left to the lattice wherever there was a sky: direct light was stated four times as wrong.
    #[test]
    fn fault_a_sun_beside_a_sky_had_no_rays() {
        let strength = [vec![0.001; 400], vec![0.6]].concat();
        let served = strongest_first(&strength, &[2000; 401]);
        assert!(served[400] && !served[..400].contains(&true));
    }

    #[test]
    fn sources_alike_are_probed_all_or_none() {
        assert_eq!(strongest_first(&[1.0; 50], &[100; 50]), [true; 50]);
        assert_eq!(strongest_first(&[1.0; 500], &[100; 500]), [false; 500]);
        // none to probe
        assert_eq!(strongest_first(&[1.0, 2.0], &[0, 3]), [false, true]);
        assert_eq!(strongest_first(&[], &[]), [false; 0]);
    }
}
