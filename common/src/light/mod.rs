//! Light that falls on the canopy: parallel sources, and a sky.

pub mod atmosphere;
mod check;
mod model;
pub mod perez;
pub mod photons;
pub mod radiance;
pub mod sky;
mod spec;
pub mod sun;
mod warnings;

use std::num::NonZeroUsize;

use glam::DVec3;

pub use check::{LightError, Origin};
pub use model::{SKY_NAMES, SkyModel};
pub use radiance::{CieType, Radiance};
pub use sky::SkyLight;
pub use spec::{MOST_GLOBAL_W_M2, Sky, SunnySky};

/// Sources closer to the horizon than this (the sine of 0.0057 degrees) are refused as horizontal:
/// at a given irradiance of the horizontal their beams would be without bounds.
pub const MIN_DESCENT: f64 = 1e-4;

/// A direction of travel that is taken, for messages.
pub const POINTS_DOWN: &str =
    "a direction of travel that points down, 0.0057 degrees below the horizon or more";

/// Whether an irradiance can be computed with: 0, or large and small enough for its square to be a number.
pub fn is_irradiance(value_W_m2: f64) -> bool {
    value_W_m2 == 0.0 || (1e-100..=1e100).contains(&value_W_m2)
}

/// An irradiance that is taken, for messages.
pub const AN_IRRADIANCE: &str = "0 or 1e-100 to 1e100";

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
    /// Direction of travel, a unit vector with `z < 0`; `z <= -MIN_DESCENT` where it is not one of a sky.
    pub direction: DVec3,
    /// Irradiance of a horizontal plane above the canopy, per band, W m⁻², each finite and `>= 0`.
    pub irradiance_W_m2: Vec<f64>,
}

impl Source {
    /// How high it stands above the horizon, degrees.
    pub fn elevation_deg(&self) -> f64 {
        let DVec3 { x, y, z } = self.direction;
        (-z).atan2(x.hypot(y)).to_degrees()
    }

    /// Where it stands: from north (y), clockwise (east, x, is 90), degrees, 0 to 360.
    pub fn azimuth_deg(&self) -> f64 {
        // adding zero turns -0 into 0
        let towards = -self.direction + DVec3::ZERO;
        let azimuth = towards.x.atan2(towards.y).to_degrees().rem_euclid(360.0);
        if azimuth < 360.0 { azimuth } else { 0.0 }
    }

    /// Irradiance of the horizontal, all bands together, W m⁻².
    pub fn irradiance_of_bands_W_m2(&self) -> f64 {
        self.irradiance_W_m2.iter().sum()
    }

    /// Irradiance of a plane that faces it, all bands together, W m⁻².
    pub fn intensity_W_m2(&self) -> f64 {
        self.irradiance_of_bands_W_m2() / -self.direction.z
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_source_knows_where_it_stands() {
        let source = |x: f64, y: f64, z: f64| Source {
            direction: DVec3::new(x, y, z).normalize(),
            irradiance_W_m2: Vec::new(),
        };
        for (source, elevation, azimuth) in [
            (source(0.0, 0.0, -1.0), 90.0, 0.0),
            (source(0.0, -1.0, -1.0), 45.0, 0.0),
            (source(1e-30, -1.0, -1.0), 45.0, 0.0),
            (source(-1.0, 0.0, -1.0), 45.0, 90.0),
            (source(0.0, 3.0_f64.sqrt(), -1.0), 30.0, 180.0),
            (source(1.0, 0.0, -1.0), 45.0, 270.0),
        ] {
            assert!((source.elevation_deg() - elevation).abs() < 1e-12);
            assert!((source.azimuth_deg() - azimuth).abs() < 1e-12, "{source:?}");
        }
        let sun = sun::Sun {
            elevation_deg: 12.5,
            azimuth_deg: 341.25,
        };
        let towards = -sun.towards();
        let source = source(towards.x, towards.y, towards.z);
        assert!((source.elevation_deg() - 12.5).abs() < 1e-12);
        assert!((source.azimuth_deg() - 341.25).abs() < 1e-12);
    }
}
