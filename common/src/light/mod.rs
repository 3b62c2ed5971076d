//! Light that falls on the canopy: parallel sources, and a sky.

pub mod sky;
mod spec;
pub mod sun;

use std::num::NonZeroUsize;

use glam::DVec3;

pub use sky::SkyLight;
pub use spec::Sky;

/// All light above a canopy.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Light {
    /// Parallel sources that are meant as they are, each with one irradiance per band: the sun, or what a file
    /// lists.
    pub suns: Vec<Source>,
    /// A sky, which is computed as many directions as an accuracy asks for.
    pub sky: Option<SkyLight>,
}

/// A parallel source: the sun, or one direction of a sky.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Direction of travel, a unit vector with `z < 0`.
    pub direction: DVec3,
    /// Irradiance of a horizontal plane above the canopy, per band, W m⁻², each finite and `>= 0`.
    pub irradiance_W_m2: Vec<f64>,
}

/// The parallel sources that a light is computed as.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources {
    /// Those of the sky, then the others.
    pub list: Vec<Source>,
    /// How many of them, from the first on, are directions that stand for a sky: another choice of directions
    /// would give another result.
    pub sky_directions: usize,
}

impl Light {
    /// Its parallel sources, with so many directions for a sky, if there is one; see [`SkyLight::sources`] for
    /// the seed.
    pub fn sources(&self, directions: NonZeroUsize, seed: u64) -> Sources {
        let sky = self.sky.as_ref();
        let mut list = sky.map_or_else(Vec::new, |sky| sky.sources(directions, seed));
        let sky_directions = list.len();
        list.extend_from_slice(&self.suns);
        Sources {
            list,
            sky_directions,
        }
    }

    /// Irradiance of the horizontal above the canopy in a band, all sources together, W m⁻².
    pub fn irradiance_W_m2(&self, band: usize) -> f64 {
        let suns: f64 = self.suns.iter().map(|s| s.irradiance_W_m2[band]).sum();
        let of_sky = |sky: &SkyLight| sky.diffuse_fraction * sky.irradiance_W_m2[band];
        suns + self.sky.as_ref().map_or(0.0, of_sky)
    }

    /// No light in any band.
    pub fn is_dark(&self) -> bool {
        let suns = self.suns.iter().flat_map(|sun| &sun.irradiance_W_m2);
        let sky = self.sky.iter().flat_map(|sky| &sky.irradiance_W_m2);
        suns.chain(sky).all(|&irradiance| irradiance == 0.0)
    }
}
