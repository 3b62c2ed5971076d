//! What of a plan is as fine as it gets: no error that is asked for makes it finer.

use super::{LEAST_ACCURACY_PERCENT, MOST_DIRECT_LINES, Plan, smallest_soil_cell_m};

/// Which parts of a plan are as fine as they get.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AtFinest {
    /// Directions of the exchange.
    pub exchange: bool,
    /// Pitch of the direct light.
    pub direct: bool,
    /// Directions of a built-in sky.
    pub sky: bool,
    /// Size of elements.
    pub elements: bool,
    /// Size of soil cells.
    pub soil: bool,
}

impl Plan {
    /// The parts that no plan makes finer.
    pub fn at_finest(&self) -> AtFinest {
        let (aims, ground_m2) = (&self.aims, self.scale.ground_area_m2);
        AtFinest {
            exchange: aims.exchange_percent <= LEAST_ACCURACY_PERCENT,
            direct: aims.direct_percent <= LEAST_ACCURACY_PERCENT
                || self.light.direct_line_area_m2 <= ground_m2 / MOST_DIRECT_LINES,
            sky: aims.has_most_sky_directions(),
            elements: aims.has_smallest_elements(),
            soil: self.trace.soil_cell_m <= smallest_soil_cell_m(&self.scale),
        }
    }
}
