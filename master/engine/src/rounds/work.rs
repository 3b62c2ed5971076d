//! What a round takes, part by part.

use nestrad_kernel::cost::{
    DRAWN_NS, ELEMENT_NS, MET_NS, RAY_NS, READ_NS, ROW_NS, SOIL_CELL_NS, SOLVED_NS, TREE_NS,
    USED_NS, Z_DEALT_NS, Z_DRAWN_NS, Z_POINT_NS,
};

use crate::lit_canopy::LitCanopy;
use crate::plan::{Plan, WorkCounts};
use crate::stopwatch::Stage;
use crate::traced::{STAGE_DIRECT_LIGHT, STAGE_EXCHANGE};

/// Parts that can be planned for: exchange, direct light, directions of a sky, elements, soil
/// cells.
pub(super) const PARTS: usize = 5;

/// A number for each of them.
pub(super) type PerPart = [f64; PARTS];

/// Time that what is reckoned takes, s: counts times constants, not clocks, so that the next round is the same on
/// any machine.
pub(super) fn work_s(counts: &WorkCounts) -> PerPart {
    let of_a_triangle = [
        counts.directions * DRAWN_NS,
        counts.sky_directions * Z_DRAWN_NS,
    ];
    let [exchange, sky] = of_a_triangle.map(|ns| ns * counts.triangles);
    [
        exchange + counts.entries * 0.5 * MET_NS,
        counts.direct_lines * Z_POINT_NS,
        sky,
        counts.elements * ELEMENT_NS,
        counts.soil_cells * SOIL_CELL_NS,
    ]
    .map(|ns| 1e-9 * ns)
}

/// Time that a whole round takes on one core, s: what is common to all plans of a scene included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Takes {
    /// To trace the exchange, and to put its rows together.
    pub(super) trace_s: f64,
    /// Direct light.
    pub(super) light_s: f64,
    /// To make the frame, to solve, to give out results.
    pub(super) rest_s: f64,
}

impl Takes {
    pub(super) fn of(lit: &LitCanopy, plan: &Plan) -> Self {
        let counts = WorkCounts::without_entries(lit, plan);
        let entries = plan.entries(lit);
        let batches = f64::from(plan.trace.sampling.map_or(0, |s| s.batches));
        let trace = counts.directions * DRAWN_NS * counts.triangles
            + 0.5 * (MET_NS - 2.0 * USED_NS) * entries.of_lines
            + RAY_NS * entries.of_rays
            + TREE_NS * counts.triangles
            + ROW_NS * batches * counts.rows;
        let light = Z_POINT_NS * counts.direct_lines
            + (Z_DRAWN_NS * counts.triangles + Z_DEALT_NS * counts.elements)
                * lit.sources.list.len() as f64;
        let solve = USED_NS * (entries.of_lines + entries.of_rays) + SOLVED_NS * counts.rows;
        Self {
            trace_s: 1e-9 * trace,
            light_s: 1e-9 * light,
            rest_s: 1e-9 * (READ_NS * counts.triangles + solve),
        }
    }

    /// What these stages took.
    pub(super) fn of_stages(stages: &[Stage]) -> Self {
        let mut took = Self {
            trace_s: 0.0,
            light_s: 0.0,
            rest_s: 0.0,
        };
        for stage in stages {
            *match &stage.name[..] {
                STAGE_EXCHANGE => &mut took.trace_s,
                STAGE_DIRECT_LIGHT => &mut took.light_s,
                _ => &mut took.rest_s,
            } += stage.wall_s;
        }
        took
    }

    /// The same where the exchange has been traced.
    pub(super) fn traced(self) -> Self {
        Self {
            trace_s: 0.0,
            ..self
        }
    }

    /// All of it.
    pub(super) fn all_s(self) -> f64 {
        self.trace_s + self.light_s + self.rest_s
    }
}
