//! From files to a checked [`Problem`]: the one door through which all input passes.

mod bands;
mod error;
mod geometry;
mod lights;
#[cfg(test)]
mod tests;

use std::path::Path;

use crate::formats::pattern::Rectangle;
use crate::formats::read::{MAX_GEOMETRY_BYTES, MAX_SMALL_BYTES, read};
use crate::formats::{self, FormatError, Mesh};
use crate::inputs::{Inputs, LightInput, PatternInput};
use crate::inspection::{Inspection, inspect};
use crate::light::SkyLight;
use crate::problem::Problem;
use crate::scene::Scene;

pub use bands::{BandOptics, resolve_band};
pub use error::LoadError;
pub use geometry::{Geometry, Origins, build_scene};
pub use lights::{LightFile, merge_sources};

/// A problem ready to be planned and solved.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Without sources if there is a sky.
    pub problem: Problem,
    /// What is in the scene and what is odd about it.
    pub inspection: Inspection,
    /// The sky that is still to be turned into sources.
    pub sky: Option<SkyLight>,
}

/// Reads a scene file. What it leaves out may come from the command line.
pub fn load_scene_file(path: &Path) -> Result<Inputs, LoadError> {
    let bytes = read(path, MAX_SMALL_BYTES)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok(formats::scene_file::parse(&name(path), &bytes, folder)?)
}

/// Reads all files of `inputs` and makes a checked problem of them.
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
    let (sources, sky) = match light {
        LightInput::File(path) => (merge_sources(&[LightFile::read(path)?], bands.len()), None),
        LightInput::Files(files) => {
            let files = lights::per_band(files, &bands)?;
            (merge_sources(&files, bands.len()), None)
        }
        LightInput::Sky {
            sky,
            irradiance_W_m2,
        } => {
            let irradiance_W_m2 = lights::values_per_band(irradiance_W_m2, &bands)?;
            let sky = sky.clone();
            (
                Vec::new(),
                Some(SkyLight {
                    sky,
                    irradiance_W_m2,
                }),
            )
        }
    };
    let (scene, origins) = build_scene(read_geometry(inputs)?)?;
    let bands = optics
        .into_iter()
        .map(|optics| resolve_band(optics, &scene, &origins))
        .collect::<Result<_, _>>()?;
    let mut inspection = inspect(&scene, &origins);
    if sky.is_none() && sources.is_empty() {
        inspection
            .warnings
            .push("no source has any light in any band".to_owned());
    }
    Ok(Loaded {
        problem: Problem {
            scene,
            bands,
            sources,
            sky_directions: 0,
        },
        inspection,
        sky,
    })
}

/// Looks through the geometry alone, as [`load`] would: for scenes whose optics or light are not good
/// yet.
pub fn inspect_geometry(inputs: &Inputs) -> Result<Inspection, LoadError> {
    let (scene, origins) = build_scene(read_geometry(inputs)?)?;
    Ok(inspect(&scene, &origins))
}

/// Reads the triangles alone, in metres: where they lie is all that a drawing of results needs.
pub fn load_scene(inputs: &Inputs) -> Result<Scene, LoadError> {
    Ok(build_scene(read_geometry(inputs)?)?.0)
}

fn read_geometry(inputs: &Inputs) -> Result<Geometry, LoadError> {
    Ok(Geometry {
        pattern: inputs.pattern.as_ref().map(read_pattern).transpose()?,
        soil: inputs.soil,
        unit: inputs.unit.unwrap_or_default(),
        meshes: inputs
            .scenes
            .iter()
            .map(|path| read_mesh(path))
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

fn read_mesh(path: &Path) -> Result<Mesh, FormatError> {
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
