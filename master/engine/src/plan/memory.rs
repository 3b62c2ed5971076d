//! How much memory a plan takes.

use serde::Serialize;

use super::{Plan, WorkCounts};
use crate::exchange::{HALF_BATCHES, Sampling};
use crate::lit_canopy::LitCanopy;

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
    pub fn of(lit: &LitCanopy, plan: &Plan) -> Self {
        const GIB: f64 = (1u64 << 30) as f64;
        let (counts, bands) = (WorkCounts::of(lit, plan), lit.optics.len() as f64);
        let (triangles, elements, rows) = (counts.triangles, counts.elements, counts.rows);
        // vertices four times, a few numbers per element, results of triangles
        let scene_bytes =
            triangles * (4.0 * 72.0 + 40.0 * bands) + elements * 60.0 + 8.0 * rows * bands * 9.0;
        let Some(sampling) = &plan.trace.sampling else {
            return Self {
                scene_GiB: scene_bytes / GIB,
                ..Self::default()
            };
        };
        // a finite sphere is judged by a glance, within it and without end
        let glances = if plan.trace.far_field.is_some() {
            let few = sampling.glance();
            let part = |s: &Sampling| f64::from(s.batches * s.sets_per_batch.max(1));
            2.0 * part(&few) / part(sampling)
        } else {
            0.0
        };
        let entries = counts.entries * (1.0 + glances);
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
