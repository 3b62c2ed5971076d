//! What a round takes, part by part.

use nestrad_kernel::cost::{DRAWN_NS, ELEMENT_NS, MET_NS, SOIL_CELL_NS, Z_DRAWN_NS, Z_POINT_NS};

use crate::plan::WorkCounts;

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
