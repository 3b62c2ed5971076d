//! What the soil beyond the map of an open scene sends out.
//!
//! It is lit by the sources, but for what plants keep from it, and by what plants scatter onto it.

use nestrad_common::light::{Source, Sources};
use nestrad_common::optics::Optics;

use crate::direct::Direct;
use crate::exchange::{Exchange, Outlook};
use crate::frame::Frame;
use crate::solver::Irradiance;

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

/// Where less comes back than this part of the incoming light, it is left out.
const WORTH_IT: f64 = 1e-5;

/// What a band has to be solved again with, because soil beyond the map sends back what plants scatter onto it: that,
/// W m⁻², indexed like [`radiosity_W_m2`]; none where it is too little to matter. The irradiances are those of the rows
/// without it, in bands that have these numbers: what it adds to itself is left out, which is as small a part of it as it
/// is of all light.
pub(crate) fn sent_back_W_m2(
    (frame, optics): (&Frame, &Optics),
    (exchange, outlook): (&Exchange, &Outlook),
    (irradiance, scattering): (&Irradiance, &[usize]),
    incoming_W: &[f64],
) -> Option<Vec<f64>> {
    let outer = frame.world.outer_soil()?;
    if outlook.outer_soil_m2.is_empty() {
        return None;
    }
    let bands = optics.len();
    let mut sent_back_W_m2 = vec![0.0; (frame.ends.outer_zones as usize + 1) * bands];
    let mut matters = false;
    for (k, &b) in scattering.iter().enumerate() {
        let band = &optics.bands[b];
        let radiosity_W_m2 = |row: usize| {
            let on = |row: usize| irradiance.mean(row, k);
            if row >= frame.ends.faces() as usize {
                return band.soil_albedo * on(row);
            }
            let t = frame.triangle_of_element[row / 2] as usize;
            let material = &band.materials[frame.material[t] as usize];
            material.radiosities([on(row & !1), on(row | 1)])[row & 1]
        };
        let onto_W = outlook.onto_outer_soil_W(frame, exchange, radiosity_W_m2);
        let mut back_W = 0.0;
        // what lies beyond all zones is too wide to be any brighter
        for (zone, onto_W) in (0..frame.ends.outer_zones).zip(onto_W) {
            let radiosity = band.soil_albedo * onto_W / outer.area_m2(zone);
            sent_back_W_m2[zone as usize * bands + b] = radiosity;
            back_W += radiosity * outlook.outer_soil_m2[zone as usize];
        }
        matters |= back_W > WORTH_IT * incoming_W[b];
    }
    matters.then_some(sent_back_W_m2)
}
