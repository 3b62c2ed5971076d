//! A scene with its bands and its light: all that a solve needs to know of the world.

use std::num::NonZeroUsize;

use crate::light::sky::SkyError;
use crate::light::{SkyLight, Source};
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
    /// How many of them, from the first on, are directions that stand for a whole sky: another choice of
    /// directions would give another result. 0 where all sources are meant as they are.
    pub sky_directions: usize,
}

impl Problem {
    /// Lights the scene by a sky, as so many directions and the sun.
    pub fn light_by(
        &mut self,
        sky: &SkyLight,
        directions: NonZeroUsize,
        seed: u64,
    ) -> Result<(), SkyError> {
        self.sources = sky.sources(directions, seed)?;
        // a sky without a diffuse part has only the sun
        self.sky_directions = match directions.get() {
            n if n <= self.sources.len() => n,
            _ => 0,
        };
        Ok(())
    }
}
