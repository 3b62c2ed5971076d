//! How many entries the rows of the exchange have, reckoned beforehand.

use glam::DVec3;
use nestrad_common::geometry;
use nestrad_kernel::elements::divisions;
use nestrad_kernel::soil::SoilGrid;

use super::Plan;
use crate::exchange::Sampling;
use crate::frame::extent_of;
use crate::lit_canopy::LitCanopy;

/// Entries of the rows of the exchange.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Entries {
    /// Batches that they come in.
    pub batches: f64,
    /// What lines see, from both their ends.
    pub of_lines: f64,
    /// What rays see, where lines are too thin.
    pub of_rays: f64,
    /// Of the two exchanges of few lines by which a finite sphere is judged.
    pub of_looks: f64,
}

impl Entries {
    /// Of the exchange.
    pub fn all(&self) -> f64 {
        self.of_lines + self.of_rays
    }
}

impl Plan {
    /// Entries of its exchange.
    pub fn entries(&self, lit: &LitCanopy) -> Entries {
        let Some(sampling) = &self.trace.sampling else {
            return Entries::default();
        };
        let extent = extent_of(lit.canopy);
        let directions = |s: &Sampling| f64::from(s.batches * s.sets_per_batch * s.axes.count());
        // each hit is seen from both sides, each line has two ends
        let hits = 0.5 * directions(sampling) * self.scale.area_m2 / sampling.line_area_m2;
        let lines = f64::from(sampling.batches) * sampling.lines_of(0, &extent);
        let of_lines = 2.0 * hits + lines;
        let of_looks = if self.trace.far_field.is_some() {
            let few = sampling.glance();
            let part = directions(&few) / directions(sampling).max(1.0);
            2.0 * (part * of_lines + self.rays(lit, &few))
        } else {
            0.0
        };
        Entries {
            batches: f64::from(sampling.batches),
            of_lines,
            of_rays: self.rays(lit, sampling),
            of_looks,
        }
    }

    /// Rays of all batches: every face casts as many as its lines fall short of.
    fn rays(&self, lit: &LitCanopy, sampling: &Sampling) -> f64 {
        let batch = sampling.batch(0);
        let Some(rays) = batch.rays else { return 0.0 };
        let of_triangle = |corners: [DVec3; 3]| {
            let n = f64::from(divisions(&corners, self.trace.max_edge_m));
            let (area_m2, longest_m) = (geometry::area(&corners), geometry::longest_edge(&corners));
            let of_face = rays.of_half(area_m2 / (n * n), longest_m / n);
            2.0 * n * n * f64::from(of_face)
        };
        let of_faces: f64 = lit.canopy.corners_m().map(of_triangle).sum();
        let of_soil = lit.canopy.soil_z_m.map_or(0.0, |z_m| {
            let cells = SoilGrid::over(&extent_of(lit.canopy), z_m, self.trace.soil_cell_m);
            let longest_m = cells.cell_m.max_element();
            let of_cell = rays.of_half(cells.cell_area_m2(), longest_m);
            f64::from(cells.len()) * f64::from(of_cell)
        });
        2.0 * (of_faces + of_soil)
    }
}
