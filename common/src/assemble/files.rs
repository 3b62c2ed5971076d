//! Which format a file is of, by its name.

use std::path::Path;

use super::LoadError;
use crate::bounded::Limit;
use crate::formats::pattern::Rectangle;
use crate::formats::read::{SMALL, read};
use crate::formats::weather::Weather;
use crate::formats::{self, FormatError, GeometryFile, Place};
use crate::inputs::{Inputs, PatternInput};

/// Endings of geometry that is read by other programs. Everything else may be CAN.
const FOREIGN: [&str; 24] = [
    "3ds", "bgeom", "blend", "dae", "dxf", "fbx", "geom", "glb", "gltf", "lpy", "mtg", "off",
    "ply", "stl", "usd", "usda", "usdc", "usdz", "vtk", "vtp", "vtu", "wrl", "x3d", "xml",
];

/// Whether a file is a scene file, by its name.
pub fn is_scene_file(path: &Path) -> bool {
    ending(path) == "toml"
}

/// Reads a scene file. What it leaves out may come from the command line.
pub fn load_scene_file(path: &Path) -> Result<Inputs, LoadError> {
    let bytes = read(path, SMALL, "a scene file (.toml)")?;
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok(formats::scene_file::parse(&name(path), &bytes, folder)?)
}

/// Reads a weather file.
pub fn load_weather(path: &Path) -> Result<Weather, LoadError> {
    let bytes = read(path, SMALL, "weather (.csv)")?;
    Ok(formats::weather::parse(&name(path), &bytes)?)
}

pub(super) fn read_geometry_file(path: &Path, limit: Limit) -> Result<GeometryFile, FormatError> {
    let ending = ending(path);
    if FOREIGN.contains(&ending.as_str()) {
        return Err(FormatError::Content {
            place: Place::file(&name(path)),
            expected: "geometry as CAN (.can) or OBJ (.obj)".to_owned(),
            found: format!("a file of the kind .{ending}"),
        });
    }
    let expected = "a scene file (.toml), CAN (.can) or OBJ (.obj)";
    let bytes = read(path, limit, expected)?;
    match ending.as_str() {
        "obj" => formats::obj::parse(&name(path), &bytes),
        _ => formats::can::parse(&name(path), &bytes),
    }
}

pub(super) fn read_pattern(pattern: &PatternInput) -> Result<Rectangle, LoadError> {
    match pattern {
        PatternInput::File(path) => {
            let bytes = read(path, SMALL, "a pattern (.8)")?;
            Ok(formats::pattern::parse(&name(path), &bytes)?)
        }
        PatternInput::Corners(corners) => {
            Rectangle::from_corners(*corners).ok_or_else(|| LoadError::Pattern {
                found: corners.map(|value| value.to_string()).join(" "),
            })
        }
    }
}

/// What stands behind the last dot of a name, `.gz` left off, in small letters.
fn ending(path: &Path) -> String {
    let name = name(path).to_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let ending = Path::new(name).extension();
    ending.map_or_else(String::new, |ending| ending.to_string_lossy().into_owned())
}

pub(super) fn name(path: &Path) -> String {
    path.display().to_string()
}
