//! A scene with its bands and its light: all that a solve needs to know of the world.

use crate::light::Source;
use crate::optics::Band;
use crate::scene::Scene;

/// What is to be computed. Checked on construction by the loaders; every later stage relies on it:
/// finite coordinates, physical optics for every material in every band, sources that travel down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Problem {
    /// The canopy.
    pub scene: Scene,
    /// In the user's order; at least one.
    pub bands: Vec<Band>,
    /// Parallel sources, each with one irradiance per band.
    pub sources: Vec<Source>,
}
