//! The options of a run as its summary keeps them, defaults included.

use std::path::Path;

use nestrad_common::inputs::{Inputs, LightInput, PatternInput};
use nestrad_common::light::{CieType, Light, Sky, SunnySky};
use nestrad_common::options::{Diameter, TableFormat, Unit, Up};
use nestrad_engine::plan::{Estimator, Settings};
use serde::Serialize;

/// What was asked for. Geometry, pattern and optics have their absolute paths, by which they are found from any
/// folder; the light is in the user's words.
#[derive(Debug, Serialize)]
pub(crate) struct OptionsRecord {
    scenes: Vec<String>,
    unit: Unit,
    up: Up,
    pattern: Option<String>,
    /// In `unit`.
    soil: Option<f64>,
    bands: Vec<BandRecord>,
    light: String,
    sources: usize,
    diameter: Diameter,
    accuracy_percent: f64,
    memory_GiB: f64,
    /// Absent where the work was done elsewhere.
    threads: Option<usize>,
    /// Where the work was done, if not here.
    master: Option<String>,
    seed: u64,
    estimator: Estimator,
    format: TableFormat,
    vtp: bool,
}

#[derive(Debug, Serialize)]
struct BandRecord {
    name: String,
    optics: Option<String>,
    /// Of the horizontal above the canopy.
    irradiance_W_m2: f64,
}

impl OptionsRecord {
    /// To be called where the work is done, if not at a master: it counts the threads there.
    pub(crate) fn new(
        inputs: &Inputs,
        light: &Light,
        settings: &Settings,
        sources: usize,
        master: Option<&str>,
    ) -> Self {
        let options = &inputs.options;
        Self {
            scenes: inputs.scenes.iter().map(|path| absolute(path)).collect(),
            unit: inputs.unit.unwrap_or_default(),
            up: inputs.up.unwrap_or_default(),
            pattern: inputs.pattern.as_ref().map(|pattern| match pattern {
                PatternInput::File(path) => absolute(path),
                PatternInput::Corners(corners) => corners.map(|c| (c + 0.0).to_string()).join(" "),
            }),
            soil: inputs.soil,
            bands: inputs
                .bands
                .iter()
                .enumerate()
                .map(|(number, band)| BandRecord {
                    irradiance_W_m2: light.irradiance_W_m2(number),
                    name: band.name.clone(),
                    optics: band.optics.as_deref().map(absolute),
                })
                .collect(),
            light: inputs
                .light
                .as_ref()
                .map(light_in_words)
                .unwrap_or_default(),
            sources,
            diameter: settings.diameter,
            accuracy_percent: settings.accuracy_percent,
            memory_GiB: settings.memory_GiB,
            threads: master.is_none().then(rayon::current_num_threads),
            master: master.map(str::to_owned),
            seed: settings.seed,
            estimator: settings.estimator,
            format: options.format.unwrap_or_default(),
            vtp: options.vtp.unwrap_or(false),
        }
    }
}

/// Where a file is, from wherever one looks.
pub(super) fn absolute(path: &Path) -> String {
    // the current folder may be gone: what the user said is all that there is then
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    whole.display().to_string()
}

/// The light in words.
fn light_in_words(light: &LightInput) -> String {
    match light {
        LightInput::File(path) => path.display().to_string(),
        LightInput::Files(files) => {
            let named = files
                .iter()
                .map(|(band, path)| format!("{band}={}", path.display()));
            named.collect::<Vec<_>>().join(", ")
        }
        LightInput::Sky {
            sky,
            irradiance_W_m2,
        } => {
            let irradiances = irradiance_W_m2
                .iter()
                .map(|(band, value)| format!("{band} {value} W m-2"));
            let irradiances = irradiances.collect::<Vec<_>>().join(", ");
            format!("{}; {irradiances}", self::sky(sky))
        }
    }
}

fn sky(sky: &Sky) -> String {
    match sky {
        Sky::UniformOvercast => "uniform overcast sky".to_owned(),
        Sky::StandardOvercast => "standard overcast sky".to_owned(),
        Sky::Sunny {
            model,
            time_utc,
            latitude_deg,
            longitude_deg,
            diffuse_fraction,
        } => {
            let name = match model {
                SunnySky::Cie(kind) if *kind == CieType::CLEAR => "clear sky".to_owned(),
                SunnySky::Cie(kind) => format!("CIE sky {}", kind.number()),
                SunnySky::Perez { global_W_m2 } => {
                    format!("sky of Perez for {global_W_m2} W m-2 of all wavelengths")
                }
            };
            format!(
                "{name} at {time_utc}, latitude {latitude_deg}, longitude {longitude_deg}, \
                 diffuse fraction {diffuse_fraction}"
            )
        }
    }
}
