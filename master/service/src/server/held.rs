//! What a master holds of a scene: the canopy on the one hand, optics and light on the other.

use std::sync::Arc;

use nestrad_common::canopy::Canopy;
use nestrad_common::inspection::Inspection;
use nestrad_common::light::Light;
use nestrad_common::optics::Optics;

use super::identity::Id;

/// A checked canopy.
#[derive(Debug)]
pub(super) struct HeldCanopy {
    pub(super) id: Id,
    pub(super) canopy: Arc<Canopy>,
    pub(super) inspection: Inspection,
}

/// Checked optics and light, which may change while the canopy stays.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lighting {
    pub(super) optics: Arc<Optics>,
    pub(super) light: Arc<Light>,
}

impl Lighting {
    /// Bytes that it takes, about.
    pub(super) fn bytes(&self) -> u64 {
        let bands = &self.optics.bands;
        let band =
            |band: &nestrad_common::optics::Band| 96 + band.name.len() + 32 * band.materials.len();
        let of_bands: usize = bands.iter().map(band).sum();
        let sources = self.light.suns.len() + usize::from(self.light.sky.is_some());
        (of_bands + sources * (56 + 8 * bands.len())) as u64
    }
}
