//! What the parts of a plan are to err by, each on its own.

use std::num::NonZeroUsize;

use nestrad_common::light::sky::directions_for;
use serde::{Deserialize, Serialize};

use super::{DEFAULT_ACCURACY_PERCENT, LEAST_ACCURACY_PERCENT};

/// Errors that a plan is made for, percent, as [`crate::solution::BandAccount`] has them; what a scene makes
/// of them is known when it is solved.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Aims {
    /// Of the exchange and of the lines of the far field.
    pub exchange_percent: f64,
    /// Of the pitch of the direct light.
    pub direct_percent: f64,
    /// Of the directions of a built-in sky.
    pub sky_percent: f64,
    /// Of the size of elements.
    pub elements_percent: f64,
    /// Of the size of soil cells.
    #[serde(default = "default_soil_percent")]
    pub soil_percent: f64,
    /// Whether lines are thinned where a single set of directions is not coarse enough: a limit is short.
    #[serde(default)]
    pub thin: bool,
}

/// What soil cells were planned for before they were among the aims.
fn default_soil_percent() -> f64 {
    DEFAULT_ACCURACY_PERCENT
}

/// Edges of elements are neither shorter nor longer than this many times those at the default accuracy.
const FINEST: f64 = 0.05;
const COARSEST: f64 = 4.0;

impl Aims {
    /// For an accuracy of which nothing else is known.
    pub fn of(accuracy_percent: f64) -> Self {
        Self {
            exchange_percent: accuracy_percent,
            direct_percent: accuracy_percent,
            // points of a lattice and directions cost nearly the same: both errors together are as asked for
            sky_percent: 0.5 * accuracy_percent,
            // large elements save little, and their error varies most from scene to scene
            elements_percent: accuracy_percent
                .min((DEFAULT_ACCURACY_PERCENT * accuracy_percent).sqrt()),
            // large cells save next to nothing
            soil_percent: accuracy_percent.min(DEFAULT_ACCURACY_PERCENT),
            thin: false,
        }
    }

    /// A coarse look at a scene, to plan by what it measures; not finer than what is asked for.
    pub fn pilot(asked_percent: f64) -> Self {
        let asked = Self::of(asked_percent);
        Self {
            exchange_percent: asked.exchange_percent.max(2.0),
            direct_percent: asked.direct_percent.max(2.0),
            sky_percent: asked.sky_percent.max(1.0),
            elements_percent: asked.elements_percent.max(2.0),
            soil_percent: DEFAULT_ACCURACY_PERCENT,
            thin: false,
        }
    }

    /// The same with no sampling that no plan can be made for.
    #[must_use]
    pub fn not_below_the_least(self) -> Self {
        Self {
            exchange_percent: self.exchange_percent.max(LEAST_ACCURACY_PERCENT),
            direct_percent: self.direct_percent.max(LEAST_ACCURACY_PERCENT),
            ..self
        }
    }

    /// The part of the way from these to finer ones that takes memory; the others go all of it.
    #[must_use]
    pub fn towards(&self, finer: &Self, part: f64) -> Self {
        let on_the_way = |from: f64, to: f64| from * (to / from).powf(part);
        Self {
            exchange_percent: on_the_way(self.exchange_percent, finer.exchange_percent),
            elements_percent: on_the_way(self.elements_percent, finer.elements_percent),
            soil_percent: on_the_way(self.soil_percent, finer.soil_percent),
            ..*finer
        }
    }

    /// The same with elements and soil cells as in others.
    #[must_use]
    pub fn with_elements_of(&self, others: &Self) -> Self {
        Self {
            elements_percent: others.elements_percent,
            soil_percent: others.soil_percent,
            ..*self
        }
    }

    /// Whether others ask for nothing else of how a canopy is traced.
    pub fn trace_as(&self, other: &Self) -> bool {
        let traced = |aims: &Self| {
            [
                aims.exchange_percent,
                aims.elements_percent,
                aims.soil_percent,
            ]
        };
        traced(self) == traced(other)
    }

    /// The same with all that takes memory as in others: there is one row of plans for all who ask for more than
    /// there is memory for, so that who asks for more is not given less.
    #[must_use]
    pub fn with_memory_of(&self, others: &Self) -> Self {
        Self {
            exchange_percent: others.exchange_percent,
            elements_percent: others.elements_percent,
            soil_percent: others.soil_percent,
            thin: true,
            ..*self
        }
    }

    /// The same with all that takes time coarser by a factor.
    #[must_use]
    pub fn quicker(&self, factor: f64) -> Self {
        Self {
            exchange_percent: self.exchange_percent * factor,
            direct_percent: self.direct_percent * factor,
            sky_percent: self.sky_percent * factor,
            elements_percent: self.elements_percent * factor,
            soil_percent: self.soil_percent * factor,
            thin: true,
        }
    }

    /// Edges of elements, in parts of those at the default accuracy.
    pub(super) fn coarser_elements(&self) -> f64 {
        (self.elements_percent / DEFAULT_ACCURACY_PERCENT).clamp(FINEST, COARSEST)
    }

    /// Sides of soil cells, in parts of those at the default accuracy.
    pub(super) fn coarser_soil_cells(&self) -> f64 {
        self.soil_percent / DEFAULT_ACCURACY_PERCENT
    }

    /// Whether a smaller error of elements would be planned with no smaller ones.
    pub(super) fn has_smallest_elements(&self) -> bool {
        self.elements_percent <= FINEST * DEFAULT_ACCURACY_PERCENT
    }

    /// The same, where edges are not longer than so many times those at the default accuracy.
    pub(super) fn with_elements_at_most(self, coarser: f64) -> Self {
        let most = DEFAULT_ACCURACY_PERCENT * coarser.clamp(FINEST, COARSEST);
        Self {
            elements_percent: self.elements_percent.min(most),
            ..self
        }
    }

    /// Whether a smaller error of a built-in sky would be planned with no more directions.
    pub fn has_most_sky_directions(&self) -> bool {
        directions_for(0.0) == self.sky_directions()
    }

    /// Directions of a built-in sky.
    pub fn sky_directions(&self) -> NonZeroUsize {
        directions_for(self.sky_percent)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pilot_is_coarse_and_not_finer_than_what_is_asked_for() {
        for asked in [0.1, 1.0, 5.0] {
            let (pilot, aims) = (Aims::pilot(asked), Aims::of(asked));
            assert!(pilot.exchange_percent >= aims.exchange_percent.max(2.0));
            assert!(pilot.elements_percent >= aims.elements_percent.max(2.0));
        }
    }

    #[test]
    fn triangles_that_are_not_cut_are_elements_of_their_own_size() {
        let coarse = Aims::of(2.0);
        let uncut = coarse.with_elements_at_most(1.0);
        assert_eq!(uncut.elements_percent, DEFAULT_ACCURACY_PERCENT);
        assert_eq!(coarse.with_elements_at_most(1e9), coarse);
    }
}
