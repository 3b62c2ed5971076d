//! What surfaces count as in balances and tables.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What the light that a surface absorbs counts as. How light is computed follows from optics alone.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A part of a plant.
    #[default]
    Leaf,
    /// Another part of a plant.
    Stem,
    /// What was built: panels, films, pots, gutters.
    Structure,
    /// The ground.
    Soil,
}

impl Kind {
    /// All of them, in the order in which they are shown.
    pub const ALL: [Self; 4] = [Self::Leaf, Self::Stem, Self::Structure, Self::Soil];

    /// A leaf or a stem.
    pub fn is_plant(self) -> bool {
        matches!(self, Self::Leaf | Self::Stem)
    }

    /// Its name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Leaf => "leaf",
            Self::Stem => "stem",
            Self::Structure => "structure",
            Self::Soil => "soil",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
