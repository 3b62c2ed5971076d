//! From files to a checked [`Scene`]: the one door through which all input passes.

mod bands;
mod error;
mod geometry;
mod kinds;
mod lights;
mod species;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use crate::canopy::Canopy;
use crate::formats::pattern::Rectangle;
use crate::formats::read::{MAX_GEOMETRY_BYTES, MAX_SMALL_BYTES, read};
use crate::formats::{self, FormatError, GeometryFile, Origins};
use crate::inputs::{Inputs, LightInput, PatternInput};
use crate::inspection::{Inspection, inspect};
use crate::light::{Light, Source};
use crate::optics::Optics;
use crate::scene::Scene;

pub use bands::{BandOptics, resolve_band};
pub use error::LoadError;
pub use geometry::{Geometry, build_canopy};
pub use lights::{LightFile, merge_sources};

/// A scene ready to be planned and solved.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Canopy, optics and light.
    pub scene: Scene,
    /// What is in it and what is odd about it.
    pub inspection: Inspection,
}

/// Reads a scene file. What it leaves out may come from the command line.
pub fn load_scene_file(path: &Path) -> Result<Inputs, LoadError> {
    let bytes = read(path, MAX_SMALL_BYTES)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok(formats::scene_file::parse(&name(path), &bytes, folder)?)
}

/// Reads all files of `inputs` and makes a checked scene of them.
pub fn load(inputs: &Inputs) -> Result<Loaded, LoadError> {
    inputs.options.check()?;
    let bands = band_names(inputs)?;
    if inputs.scenes.is_empty() {
        return Err(LoadError::Missing {
            expected: "a scene: a CAN or OBJ file",
        });
    }
    let Some(light) = &inputs.light else {
        return Err(LoadError::Missing {
            expected: "light (--light or --sky, or light in a scene file)",
        });
    };
    light.check()?;

    // small files first: what is wrong with them should not wait for a canopy to be read
    let optics = inputs
        .bands
        .iter()
        .map(BandOptics::read)
        .collect::<Result<Vec<_>, _>>()?;
    let light = self::light(light, &bands)?;
    let (canopy, origins) = read_canopy(inputs)?;
    let bands = optics
        .into_iter()
        .map(|optics| resolve_band(optics, &canopy, &origins))
        .collect::<Result<_, _>>()?;
    let mut inspection = inspect(&canopy, &origins);
    inspection.warnings.extend(kinds::unknown(inputs, &canopy));
    if light.is_dark() {
        inspection
            .warnings
            .push("no source has any light in any band".to_owned());
    }
    Ok(Loaded {
        scene: Scene {
            canopy: Arc::new(canopy),
            optics: Arc::new(Optics { bands }),
            light: Arc::new(light),
        },
        inspection,
    })
}

/// The light of an input, which is the same for whoever solves: here, or a master elsewhere.
fn light(input: &LightInput, bands: &[String]) -> Result<Light, LoadError> {
    let of_files = |suns: Vec<Source>| Light { suns, sky: None };
    Ok(match input {
        LightInput::File(path) => of_files(merge_sources(&[LightFile::read(path)?], bands.len())),
        LightInput::Files(files) => {
            let files = lights::per_band(files, bands)?;
            of_files(merge_sources(&files, bands.len()))
        }
        LightInput::Sky {
            sky,
            irradiance_W_m2,
        } => sky.light(lights::values_per_band(irradiance_W_m2, bands)?)?,
    })
}

/// Looks through the geometry alone, as [`load`] would: for scenes whose optics or light are not good
/// yet.
pub fn inspect_geometry(inputs: &Inputs) -> Result<Inspection, LoadError> {
    let (canopy, origins) = read_canopy(inputs)?;
    let mut inspection = inspect(&canopy, &origins);
    inspection.warnings.extend(kinds::unknown(inputs, &canopy));
    Ok(inspection)
}

/// Reads the canopy alone, in metres: where it stands is all that a drawing of results needs.
pub fn load_canopy(inputs: &Inputs) -> Result<Canopy, LoadError> {
    Ok(read_canopy(inputs)?.0)
}

fn read_canopy(inputs: &Inputs) -> Result<(Canopy, Origins), LoadError> {
    let (mut canopy, origins) = build_canopy(read_geometry(inputs)?)?;
    canopy.declared = kinds::declared(inputs, &canopy);
    Ok((canopy, origins))
}

fn read_geometry(inputs: &Inputs) -> Result<Geometry, LoadError> {
    Ok(Geometry {
        pattern: inputs.pattern.as_ref().map(read_pattern).transpose()?,
        soil: inputs.soil,
        unit: inputs.unit.unwrap_or_default(),
        files: inputs
            .scenes
            .iter()
            .map(|path| read_geometry_file(path))
            .collect::<Result<_, _>>()?,
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
        if name.is_empty() || names[..index].contains(name) {
            return Err(LoadError::BandName { name: name.clone() });
        }
    }
    Ok(names)
}

fn read_geometry_file(path: &Path) -> Result<GeometryFile, FormatError> {
    let bytes = read(path, MAX_GEOMETRY_BYTES)?;
    let file = name(path);
    let lower = file.to_lowercase();
    if lower.ends_with(".obj") || lower.ends_with(".obj.gz") {
        formats::obj::parse(&file, &bytes)
    } else {
        formats::can::parse(&file, &bytes)
    }
}

fn read_pattern(pattern: &PatternInput) -> Result<Rectangle, LoadError> {
    match pattern {
        PatternInput::File(path) => {
            let bytes = read(path, MAX_SMALL_BYTES)?;
            Ok(formats::pattern::parse(&name(path), &bytes)?)
        }
        PatternInput::Corners(corners) => {
            Rectangle::from_corners(*corners).ok_or_else(|| LoadError::Pattern {
                found: corners.map(|value| value.to_string()).join(" "),
            })
        }
    }
}

fn name(path: &Path) -> String {
    path.display().to_string()
}
