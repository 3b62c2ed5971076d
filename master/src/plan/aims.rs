//! What the parts of a plan are to err by, each on its own.

use std::num::NonZeroUsize;

use nestrad_common::light::sky::directions_for;
use serde::{Deserialize, Serialize};

use super::DEFAULT_ACCURACY_PERCENT;

/// Errors that a plan is made for, percent, as [`crate::errors::ErrorParts`] has them; what a scene makes
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
}

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
