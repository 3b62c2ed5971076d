//! A canopy in its light, as it is planned and computed.

use nestrad_common::canopy::Canopy;
use nestrad_common::light::Sources;
use nestrad_common::optics::Optics;
use nestrad_common::sensors::Sensor;

/// A canopy, its optics, the parallel sources that its light is computed as, and sensors.
#[derive(Clone, Copy, Debug)]
pub struct LitCanopy<'a> {
    /// The geometry.
    pub canopy: &'a Canopy,
    /// Of its materials, in its order.
    pub optics: &'a Optics,
    /// What shines on it.
    pub sources: &'a Sources,
    /// Whose light is wanted besides.
    pub sensors: &'a [Sensor],
}
