//! What the solver begins with of ends that are not rows: of far ends what the layer model says, before the field is
//! closed on the solution.

use std::f64::consts::PI;
use std::num::NonZeroUsize;

use nestrad_common::light::{Source, Sources};
use nestrad_common::optics::Optics;

use super::layers::Layers;
use super::transport;
use crate::frame::Frame;

/// Radiosities (pi times radiance) of the far ends by the layer model, W m⁻², indexed
/// `far end * bands + band`.
fn from_layers(frame: &Frame, optics: &Optics, sources: &[Source]) -> Vec<f64> {
    let bands = optics.len();
    let mut start = vec![0.0; frame.ends.far_ends as usize * bands];
    let Some(grid) = &frame.world.far else {
        return start;
    };
    let count = |n: u32| NonZeroUsize::new(n as usize).unwrap_or(NonZeroUsize::MIN);
    let [levels, bins] = grid.layers().map(count);
    let layers = count(levels.get() as u32 - 1);
    let triangles = frame.soup().triangles().zip(frame.material.iter().copied());
    let ground = (frame.pattern, frame.world.soil.map(|soil| soil.z_m));
    let layers = Layers::of(triangles, ground, layers, count(INCLINATION_CLASSES));
    // without ground under it a scene has no layers, and the field starts from nothing
    let Ok(layers) = layers else {
        return start;
    };
    for (b, band) in optics.bands.iter().enumerate() {
        let soil = frame.world.soil.map(|_| band.soil_albedo);
        let field = transport::solve(&layers, band, b, sources, soil, bins);
        for end in 0..frame.ends.far_ends {
            let place = grid.in_layers(end);
            let (level, bin) = (place.level as usize, place.bin as usize);
            if level >= field.levels() {
                continue;
            }
            let radiance = if place.from_above {
                field.radiance_down(level, bin)
            } else {
                field.radiance_up(level, bin)
            };
            start[end as usize * bands + b] = PI * radiance;
        }
    }
    start
}

/// Classes of leaf inclination in the layers: against 900 they change the albedo by less than 2e-5.
const INCLINATION_CLASSES: u32 = 18;

/// Radiosities of the ends that are not rows, W m⁻², indexed `(end - rows) * bands + band`: dark, but for the soil
/// beyond the map of an open scene, which sends out these, and the start of
/// the far field.
pub fn fixed_radiosity_W_m2(
    frame: &Frame,
    optics: &Optics,
    sources: &Sources,
    outer_soil_W_m2: &[f64],
) -> Vec<f64> {
    let (ends, bands) = (&frame.ends, optics.len());
    let mut fixed = vec![0.0; (ends.len() - frame.rows()) * bands];
    let at = |end: u32| (end - ends.rows()) as usize * bands;
    let (of_zones, beyond) = outer_soil_W_m2.split_at(ends.outer_zones as usize * bands);
    let [first, first_far, first_zone] = [ends.outer_soil(), ends.far(0), ends.zone(0)].map(at);
    fixed[first..first + beyond.len()].copy_from_slice(beyond);
    fixed[first_far..first_zone].copy_from_slice(&from_layers(frame, optics, &sources.list));
    fixed[first_zone..].copy_from_slice(of_zones);
    fixed
}
