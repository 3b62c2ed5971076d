//! What a round takes, part by part.

use nestrad_kernel::cost::{
    DRAWN_NS, ELEMENT_NS, MET_NS, RAY_NS, READ_NS, ROW_NS, SOIL_CELL_NS, SOLVED_NS, TREE_NS,
    USED_NS, Z_DRAWN_NS, Z_POINT_NS,
};

use crate::lit_canopy::LitCanopy;
use crate::plan::{Plan, WorkCounts};

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
pub(super) fn all_s(lit: &LitCanopy, plan: &Plan) -> f64 {
    let counts = WorkCounts::without_entries(lit, plan);
    let entries = plan.entries(lit);
    let batches = f64::from(plan.trace.sampling.map_or(0, |s| s.batches));
    let trace = counts.directions * DRAWN_NS * counts.triangles
        + 0.5 * (MET_NS - 2.0 * USED_NS) * entries.of_lines
        + RAY_NS * entries.of_rays
        + TREE_NS * counts.triangles
        + ROW_NS * batches * counts.rows;
    let solve = USED_NS * (entries.of_lines + entries.of_rays) + SOLVED_NS * counts.rows;
    let direct = Z_POINT_NS * counts.direct_lines
        + Z_DRAWN_NS * lit.sources.list.len() as f64 * counts.triangles;
    1e-9 * (READ_NS * counts.triangles + trace + solve + direct)
}
