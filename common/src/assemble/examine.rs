//! Inputs looked through as far as they go: what is not given is not asked for.

use super::{
    BandOptics, LoadError, NO_SCENE, band_names, inspected, light as light_of, resolve_band,
    sensors,
};
use crate::canopy::Canopy;
use crate::formats::Origins;
use crate::inputs::{Inputs, LightInput};
use crate::inspection::Inspection;
use crate::light::Light;
use crate::optics::Optics;
use crate::sensors::Sensor;

/// What there is, and what is wrong with the rest.
#[derive(Debug, Default)]
pub struct Examined {
    /// The geometry, if it is good.
    pub canopy: Option<(Canopy, Inspection)>,
    /// The optics, if they are given, and good for the geometry.
    pub optics: Option<Optics>,
    /// The light, if it is given and good.
    pub light: Option<Light>,
    /// The bands that the light is given for: those of the optics, or else of the light itself. A name is empty where
    /// nobody gave one.
    pub light_bands: Vec<String>,
    /// Sensors, if they are good for the geometry.
    pub sensors: Vec<Sensor>,
    /// Why [`load`](super::load) would refuse what is given.
    pub faults: Vec<LoadError>,
}

/// Reads all files of `inputs`, which may be any part of a scene with geometry.
pub fn examine(inputs: &Inputs) -> Examined {
    let mut found = Examined::default();
    let options = inputs.options.check();
    found.faults.extend(options.err().map(LoadError::from));
    let geometry = if inputs.scenes.is_empty() {
        Err(NO_SCENE)
    } else {
        inspected(inputs)
    };
    let geometry = found.good(geometry);
    if !inputs.bands.is_empty() {
        found.optics(inputs, geometry.as_ref());
    }
    if let Some(light) = &inputs.light {
        found.light(inputs, light);
    }
    if let Some((canopy, ..)) = &geometry {
        let unit = inputs.unit.unwrap_or_default();
        let placed = sensors::placed(&inputs.sensors, unit, canopy);
        found.sensors = found
            .good(placed.map_err(LoadError::from))
            .unwrap_or_default();
    }
    found.canopy = geometry.map(|(canopy, _, mut inspection)| {
        if let Some(light) = &found.light {
            let bands: Vec<&str> = found.light_bands.iter().map(String::as_str).collect();
            inspection.add_light(light, &bands);
        }
        (canopy, inspection)
    });
    found
}

impl Examined {
    fn good<T>(&mut self, result: Result<T, LoadError>) -> Option<T> {
        result.map_err(|fault| self.faults.push(fault)).ok()
    }

    fn optics(&mut self, inputs: &Inputs, geometry: Option<&(Canopy, Origins, Inspection)>) {
        let names = band_names(inputs);
        let mut good = self.good(names).is_some();
        let mut bands = Vec::new();
        for band in &inputs.bands {
            let read = BandOptics::read(band);
            let band = self.good(read).and_then(|optics| {
                let (canopy, origins, _) = geometry?;
                let band = resolve_band(optics, canopy, origins);
                self.good(band)
            });
            good &= band.is_some();
            bands.extend(band);
        }
        self.optics = good.then_some(Optics { bands });
    }

    fn light(&mut self, inputs: &Inputs, light: &LightInput) {
        let given = inputs.bands.iter().map(|band| band.name.clone());
        self.light_bands = match light {
            _ if !inputs.bands.is_empty() => given.collect(),
            LightInput::File(_) => vec![String::new()],
            LightInput::Files(files) => files.keys().cloned().collect(),
            LightInput::Sky {
                irradiance_W_m2, ..
            } => irradiance_W_m2.keys().cloned().collect(),
        };
        let checked = light.check().map_err(LoadError::from);
        let light = checked.and_then(|()| light_of(light, &self.light_bands));
        self.light = self.good(light);
    }
}
