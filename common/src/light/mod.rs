//! Light that falls on the canopy: a list of parallel sources.

pub mod sky;
mod spec;
pub mod sun;

use glam::DVec3;

pub use spec::{Sky, SkyLight};

/// A parallel source: the sun, or one direction of a sky.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Direction of travel, a unit vector with `z < 0`.
    pub direction: DVec3,
    /// Irradiance of a horizontal plane above the canopy, per band, W m⁻², each finite and `>= 0`.
    pub irradiance_W_m2: Vec<f64>,
}
