//! The options of a series as its summary keeps them, defaults included.

use nestrad_common::inputs::{Inputs, PatternInput};
use nestrad_common::light::SkyModel;
use nestrad_common::options::{Diameter, TableFormat, Unit, Up};
use nestrad_common::weather::Site;
use nestrad_engine::plan::Settings;
use serde::Serialize;

use super::source::Source;
use crate::cli::record::absolute;

#[derive(Debug, Serialize)]
pub(super) struct SeriesRecord<'a> {
    scenes: Vec<String>,
    unit: Unit,
    up: Up,
    pattern: Option<String>,
    /// In `unit`.
    soil: Option<f64>,
    bands: Vec<BandRecord<'a>>,
    weather: &'a Source,
    sky: String,
    latitude_deg: f64,
    longitude_deg: f64,
    diameter: Diameter,
    accuracy_percent: f64,
    memory_GiB: f64,
    threads: usize,
    seed: u64,
    format: TableFormat,
}

#[derive(Debug, Serialize)]
struct BandRecord<'a> {
    name: &'a str,
    optics: Option<String>,
    /// Of broadband irradiance, where the weather has no columns of the band.
    band_fraction: Option<f64>,
    photon_umol_J: Option<f64>,
}

impl<'a> SeriesRecord<'a> {
    /// To be called where the work is done: it counts the threads there.
    pub(super) fn of(
        inputs: &'a Inputs,
        settings: &Settings,
        (weather, sky, site): (&'a Source, SkyModel, Site),
    ) -> Self {
        let options = &inputs.options;
        let bands = inputs.bands.iter().map(|band| BandRecord {
            name: &band.name,
            optics: band.optics.as_deref().map(absolute),
            band_fraction: inputs.band_fraction.get(&band.name).copied(),
            photon_umol_J: band.photon_umol_J,
        });
        Self {
            scenes: inputs.scenes.iter().map(|path| absolute(path)).collect(),
            unit: inputs.unit.unwrap_or_default(),
            up: inputs.up.unwrap_or_default(),
            pattern: inputs.pattern.as_ref().map(|pattern| match pattern {
                PatternInput::File(path) => absolute(path),
                PatternInput::Corners(corners) => corners.map(|c| (c + 0.0).to_string()).join(" "),
            }),
            soil: inputs.soil,
            bands: bands.collect(),
            weather,
            sky: sky.to_string(),
            latitude_deg: site.latitude_deg,
            longitude_deg: site.longitude_deg,
            diameter: settings.diameter,
            accuracy_percent: settings.accuracy_percent,
            memory_GiB: settings.memory_GiB,
            threads: rayon::current_num_threads(),
            seed: settings.seed,
            format: options.format.unwrap_or_default(),
        }
    }
}
