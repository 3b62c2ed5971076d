//! From files to a checked [`Scene`]: the one door through which all input passes.

mod bands;
mod error;
mod examine;
mod files;
mod geometry;
mod kinds;
mod lights;
mod sensors;
mod species;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use crate::canopy::{Canopy, MAX_NAME_BYTES};
use crate::formats::Origins;
use crate::formats::read::{SMALL, geometry_limit};
use crate::inputs::{Inputs, LightInput};
use crate::inspection::{Inspection, inspect};
use crate::light::{Light, Source};
use crate::optics::Optics;
use crate::scene::Scene;
use crate::sensors::Sensor;

pub use bands::{BandOptics, resolve_band};
pub use error::LoadError;
pub use examine::{Examined, examine};
use files::name;
pub use files::{is_scene_file, load_scene_file, load_weather};
pub use geometry::{Geometry, build_canopy};
pub use lights::{LightFile, merge_sources};
pub use sensors::{SensorFault, check_sensor};

/// A scene ready to be planned and solved.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Canopy, optics and light.
    pub scene: Scene,
    /// What is in it and what is odd about it.
    pub inspection: Inspection,
}

/// A scene without its light.
#[derive(Clone, Debug)]
pub struct Unlit {
    /// The geometry.
    pub canopy: Arc<Canopy>,
    /// What its surfaces do with the light of each band.
    pub optics: Arc<Optics>,
    /// Where light is to be measured.
    pub sensors: Arc<[Sensor]>,
    /// What is in it and what is odd about it.
    pub inspection: Inspection,
}

/// Reads all files of `inputs` and makes a checked scene of them.
pub fn load(inputs: &Inputs) -> Result<Loaded, LoadError> {
    inputs.options.check()?;
    let bands = band_names(inputs)?;
    if inputs.scenes.is_empty() {
        return Err(NO_SCENE);
    }
    let Some(light) = &inputs.light else {
        return Err(LoadError::Missing {
            expected: "light (--light or --sky, or light in a scene file)",
        });
    };
    light.check()?;
    let with_light = || self::light(light, &bands);
    let (unlit, light) = unlit(inputs, with_light)?;
    let mut inspection = unlit.inspection;
    inspection.add_light(&light, &unlit.optics.names());
    Ok(Loaded {
        scene: Scene {
            canopy: unlit.canopy,
            optics: unlit.optics,
            light: Arc::new(light),
            sensors: unlit.sensors,
        },
        inspection,
    })
}

/// Reads all files of `inputs` but those of its light.
pub fn load_unlit(inputs: &Inputs) -> Result<Unlit, LoadError> {
    inputs.options.check()?;
    band_names(inputs)?;
    if inputs.scenes.is_empty() {
        return Err(NO_SCENE);
    }
    Ok(unlit(inputs, || Ok(()))?.0)
}

/// Reads small files first, those of the light among them: what is wrong with them should not wait for a canopy to be
/// read.
fn unlit<T>(
    inputs: &Inputs,
    light: impl FnOnce() -> Result<T, LoadError>,
) -> Result<(Unlit, T), LoadError> {
    let optics = inputs
        .bands
        .iter()
        .map(BandOptics::read)
        .collect::<Result<Vec<_>, _>>()?;
    let light = light()?;
    let (canopy, origins, inspection) = inspected(inputs)?;
    let bands = optics
        .into_iter()
        .map(|optics| resolve_band(optics, &canopy, &origins))
        .collect::<Result<_, _>>()?;
    let sensors = sensors::placed(&inputs.sensors, inputs.unit.unwrap_or_default(), &canopy)?;
    let unlit = Unlit {
        sensors: sensors.into(),
        canopy: Arc::new(canopy),
        optics: Arc::new(Optics { bands }),
        inspection,
    };
    Ok((unlit, light))
}

const NO_SCENE: LoadError = LoadError::Missing {
    expected: "a scene: a CAN or OBJ file",
};

/// The light of an input, which is the same for whoever solves: here, or a master elsewhere.
fn light(input: &LightInput, bands: &[String]) -> Result<Light, LoadError> {
    let of_files = |suns: Vec<Source>| Light { suns, sky: None };
    let light = match input {
        LightInput::File(path) => of_files(merge_sources(&[LightFile::read(path)?], bands.len())),
        LightInput::Files(files) => {
            let files = lights::per_band(files, bands)?;
            of_files(merge_sources(&files, bands.len()))
        }
        LightInput::Sky {
            sky,
            irradiance_W_m2,
        } => sky.light(lights::values_per_band(irradiance_W_m2, bands)?)?,
    };
    light.check(bands.iter().map(String::as_str))?;
    Ok(light)
}

/// Reads the geometry and looks through it.
fn inspected(inputs: &Inputs) -> Result<(Canopy, Origins, Inspection), LoadError> {
    let geometry = read_geometry(inputs)?;
    let of_files = geometry.files.iter();
    let warnings: Vec<String> = of_files.flat_map(|file| file.warnings.clone()).collect();
    let (canopy, origins) = canopy_of(geometry, inputs)?;
    let mut inspection = inspect(&canopy, &origins);
    inspection.warnings.splice(0..0, warnings);
    inspection.warnings.extend(kinds::unknown(inputs, &canopy));
    Ok((canopy, origins, inspection))
}

/// Reads the canopy alone, in metres: where it stands is all that a drawing of results needs.
pub fn load_canopy(inputs: &Inputs) -> Result<Canopy, LoadError> {
    Ok(canopy_of(read_geometry(inputs)?, inputs)?.0)
}

/// The canopy of a geometry, with the kinds that inputs declare.
fn canopy_of(geometry: Geometry, inputs: &Inputs) -> Result<(Canopy, Origins), LoadError> {
    let (mut canopy, origins) = build_canopy(geometry)?;
    canopy.declared = kinds::declared(inputs, &canopy);
    canopy.opaque_stems = kinds::opaque_stems(inputs, &canopy);
    Ok((canopy, origins))
}

fn read_geometry(inputs: &Inputs) -> Result<Geometry, LoadError> {
    let mut limit = geometry_limit(inputs.options.memory_GiB);
    let mut files = Vec::with_capacity(inputs.scenes.len());
    for path in &inputs.scenes {
        let file = files::read_geometry_file(path, limit)?;
        limit.bytes = limit
            .bytes
            .saturating_sub(file.mesh.bytes())
            .max(SMALL.bytes);
        files.push(file);
    }
    Ok(Geometry {
        pattern: inputs
            .pattern
            .as_ref()
            .map(files::read_pattern)
            .transpose()?,
        soil: inputs.soil,
        unit: inputs.unit.unwrap_or_default(),
        up: inputs.up.unwrap_or_default(),
        files,
    })
}

fn band_names(inputs: &Inputs) -> Result<Vec<String>, LoadError> {
    let names: Vec<String> = inputs.bands.iter().map(|band| band.name.clone()).collect();
    if names.is_empty() {
        return Err(LoadError::Missing {
            expected: "at least one band with its optics (--optics, or [[bands]] in a scene file)",
        });
    }
    for (index, name) in names.iter().enumerate() {
        let length = 1..=MAX_NAME_BYTES;
        if !length.contains(&name.len()) || names[..index].contains(name) {
            let name = name.chars().take(40).collect();
            return Err(LoadError::BandName { name });
        }
    }
    Ok(names)
}
