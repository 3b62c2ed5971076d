//! What the soil beyond the map of an open scene sends out.
//!
//! It is lit by the sources, but for what plants keep from it. What plants scatter onto it is left out.

use nestrad_common::light::{Source, Sources};
use nestrad_common::optics::Optics;

use crate::direct::Direct;
use crate::frame::Frame;

/// Radiosity of each zone of the soil around the map of an open scene, and of what lies beyond all zones, W m⁻²,
/// indexed `zone * bands + band`; dark where there is no such soil.
pub(crate) fn radiosity_W_m2(
    frame: &Frame,
    optics: &Optics,
    sources: &Sources,
    direct: &Direct,
) -> Vec<f64> {
    let (zones, bands) = (frame.ends.outer_zones as usize, optics.len());
    let mut radiosity = vec![0.0; (zones + 1) * bands];
    if frame.world.soil.is_none() || frame.world.extent.periodic {
        return radiosity;
    }
    for (b, band) in optics.bands.iter().enumerate() {
        let of_source = |source: &Source| source.irradiance_W_m2[b];
        let unshaded: f64 = sources.list.iter().map(of_source).sum();
        for (zone, out) in radiosity.iter_mut().skip(b).step_by(bands).enumerate() {
            let shade = direct.shade_W_m2.get(zone * bands + b).unwrap_or(&0.0);
            // what is all in the shade may come out a rounding below
            *out = band.soil_albedo * (unshaded - shade).max(0.0);
        }
    }
    radiosity
}
