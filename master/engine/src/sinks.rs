//! What the light of a band is shared out to.

use nestrad_common::canopy::Kind;

/// Where light ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sink {
    /// Leaves and stems.
    Plants,
    /// A part of the plants.
    Leaves,
    /// The other part.
    Stems,
    /// What is declared to be one.
    Structures,
    /// Triangles of soil, and the soil plane.
    Soil,
    /// The sky.
    Up,
    /// The void below.
    Down,
}

/// A number for each sink.
pub(crate) const SINKS: usize = 7;

impl Sink {
    /// All that there is, each once.
    pub(crate) const WHOLE: [Self; 5] = [
        Self::Plants,
        Self::Structures,
        Self::Soil,
        Self::Up,
        Self::Down,
    ];

    /// What the light that a kind of surface absorbs is counted for.
    pub(crate) fn of(kind: Kind) -> &'static [Self] {
        match kind {
            Kind::Leaf => &[Self::Plants, Self::Leaves],
            Kind::Stem => &[Self::Plants, Self::Stems],
            Kind::Structure => &[Self::Structures],
            Kind::Soil => &[Self::Soil],
        }
    }
}
