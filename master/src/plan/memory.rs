//! How much memory a plan takes.

use nestrad_common::elements::Elements;
use nestrad_common::problem::Problem;
use serde::Serialize;

use super::Plan;
use crate::exchange::Sampling;
use crate::solver::HALF_BATCHES;
use crate::world::{SoilGrid, extent_of};

/// Memory of the large parts of a solve, GiB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Memory {
    /// Triangles, elements and their results.
    pub scene_GiB: f64,
    /// Rows of the exchange.
    pub rows_GiB: f64,
    /// Irradiances, radiosities and error estimates.
    pub solver_GiB: f64,
}

impl Memory {
    /// Estimated from the sizes in a plan; measured on `maize_rows` and `bean_rows`.
    pub fn of(problem: &Problem, plan: &Plan) -> Self {
        const GIB: f64 = (1u64 << 30) as f64;
        let (scale, bands) = (&plan.scale, problem.bands.len() as f64);
        let scene = &problem.scene;
        let triangles = scene.triangles.len() as f64;
        let elements = Elements::count(scene, plan.max_edge_m) as f64;
        let extent = extent_of(scene);
        let soil = scene
            .soil_z_m
            .map(|z_m| SoilGrid::over(&extent, z_m, plan.soil_cell_m));
        let rows = 2.0 * elements + soil.map_or(0.0, |s| f64::from(s.cells()));
        // vertices four times, a few numbers per element, results of triangles
        let scene_bytes =
            triangles * (4.0 * 72.0 + 40.0 * bands) + elements * 60.0 + 8.0 * rows * bands * 9.0;
        let Some(sampling) = &plan.sampling else {
            return Self {
                scene_GiB: scene_bytes / GIB,
                ..Self::default()
            };
        };
        let directions =
            f64::from(sampling.batches * sampling.sets_per_batch * sampling.axes.count());
        // each hit is seen from both sides, each line has two ends
        let hits = 0.5 * directions * scale.area_m2 / sampling.line_area_m2;
        let lines = sampling.lines(&extent);
        let rays =
            f64::from(sampling.batches) * sampling.least_samples * rows / HALF_BATCHES as f64;
        let entries = 2.0 * hits
            + lines
            + if sampling.sets_per_batch == 0 {
                rays
            } else {
                0.1 * rays
            };
        // a finite sphere is judged by a glance, within it and without end
        let glances = if plan.far_field.is_some() {
            let few = sampling.glance();
            let part = |s: &Sampling| f64::from(s.batches * s.sets_per_batch.max(1));
            2.0 * part(&few) / part(sampling)
        } else {
            0.0
        };
        let entries = entries * (1.0 + glances);
        // a batch is held twice while it is sorted
        let transient = 2.0 * 4.0 * entries / f64::from(sampling.batches);
        Self {
            scene_GiB: scene_bytes / GIB,
            rows_GiB: (4.0 * entries + transient + 4.0 * rows * f64::from(sampling.batches)) / GIB,
            solver_GiB: rows * (8.0 * HALF_BATCHES as f64 * 6.0 + 48.0 * bands) / GIB,
        }
    }

    /// All of it.
    pub fn total_GiB(&self) -> f64 {
        self.scene_GiB + self.rows_GiB + self.solver_GiB
    }
}
