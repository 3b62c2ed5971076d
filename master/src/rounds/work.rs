//! What a round takes, part by part.

use crate::plan::{Counts, DRAWN_NS};

/// Parts that can be planned for: exchange, direct light, directions of a sky, elements.
pub(super) const PARTS: usize = 4;

/// A number for each of them.
pub(super) type PerPart = [f64; PARTS];

/// Rough times of one core, ns: only their ratios matter. They are counts times constants, not clocks, so that
/// the next round is the same on any machine.
const ROW_ENTRY_NS: f64 = 80.0;
/// Of a triangle along a direction of a sky.
const SKY_TRIANGLE_NS: f64 = 40.0;
const DIRECT_LINE_NS: f64 = 75.0;
/// 8 000 where lines are dense enough for smaller elements anyway, 20 000 and more where they have to be denser.
const ELEMENT_NS: f64 = 12_000.0;

/// Time that what is reckoned takes, s.
pub(super) fn work_s(counts: &Counts) -> PerPart {
    let of_a_triangle = [
        counts.directions * DRAWN_NS,
        counts.sky_directions * SKY_TRIANGLE_NS,
    ];
    let [exchange, sky] = of_a_triangle.map(|ns| ns * counts.triangles);
    [
        exchange + counts.entries * ROW_ENTRY_NS,
        counts.direct_lines * DIRECT_LINE_NS,
        sky,
        counts.elements * ELEMENT_NS,
    ]
    .map(|ns| 1e-9 * ns)
}
