//! A scene: a canopy, its optics and its light, each of which can be changed without the others.

use std::sync::Arc;

use crate::canopy::Canopy;
use crate::light::Light;
use crate::optics::Optics;
use crate::sensors::Sensor;

/// All that a solve needs to know of the world. Checked by whoever makes it (files, clients); every later stage
/// relies on it: finite coordinates, physical optics for every material in every band, sources that travel down.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// The geometry.
    pub canopy: Arc<Canopy>,
    /// What surfaces do with the light of each band.
    pub optics: Arc<Optics>,
    /// What comes from above.
    pub light: Arc<Light>,
    /// Whose light is wanted besides.
    pub sensors: Arc<[Sensor]>,
}
