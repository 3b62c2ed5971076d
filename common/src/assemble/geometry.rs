//! Files to a canopy: in metres, from a local origin.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::{LoadError, species};
use crate::canopy::{Canopy, Material, Mesh, Organ, Pattern};
use crate::formats::pattern::{MIN_SIDE, Rectangle};
use crate::formats::{GeometryFile, MAX_COORDINATE, MAX_TRIANGLES, Origins, Place, numbered};
use crate::options::{Unit, Up};

/// The geometry of a canopy as the user gave it.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// One per file.
    pub files: Vec<GeometryFile>,
    /// Where the canopy repeats, in `unit`.
    pub pattern: Option<Rectangle>,
    /// Height of the soil plane, in `unit`.
    pub soil: Option<f64>,
    /// Of all of it.
    pub unit: Unit,
    /// Of the files; the pattern and the soil have z up.
    pub up: Up,
}

/// Joins the files, stands them upright, converts to metres and moves everything to a local origin: the lower corner of
/// the pattern, or else of the scene, at the height of the scene's lowest vertex. There a double
/// resolves every leaf, and nothing later needs to know how far away the user's origin is.
///
/// Materials of the same name are the same, whichever file they come from. An organ is all in one file: two files
/// with one of the same name are refused. A file that does not say what species it holds is named after itself.
pub fn build_canopy(geometry: Geometry) -> Result<(Canopy, Origins), LoadError> {
    let Geometry {
        files,
        pattern,
        soil,
        unit,
        up,
    } = geometry;
    let names = || {
        let names: Vec<&str> = files.iter().map(|file| file.file.as_str()).collect();
        names.join(", ")
    };
    let total: usize = files.iter().map(|file| file.mesh.len()).sum();
    if total == 0 {
        return Err(LoadError::EmptyScene { files: names() });
    }
    if total > MAX_TRIANGLES {
        let (files, found) = (names(), total);
        return Err(LoadError::TooManyTriangles { files, found });
    }
    let proper = |z: &f64| z.is_finite() && z.abs() <= MAX_COORDINATE;
    if let Some(found) = soil.filter(|z| !proper(z)) {
        return Err(LoadError::SoilHeight { found });
    }

    let paths: Vec<&Path> = files.iter().map(|file| Path::new(&file.file)).collect();
    let species = species::names(&paths);
    let mut joined = Joined::default();
    for (file, species) in files.into_iter().zip(&species) {
        joined.add(file, species)?;
    }
    let per_metre = unit.per_metre();
    let mut lower = DVec3::INFINITY;
    for vertex in joined.vertices() {
        *vertex = up.stand(*vertex) / per_metre;
        lower = lower.min(*vertex);
    }
    let pattern = pattern
        .map(|pattern| {
            let min = pattern.min / per_metre;
            lower = min.extend(lower.z);
            let size_m = pattern.max / per_metre - min;
            if size_m.min_element() < MIN_SIDE {
                let Rectangle { min, max } = pattern;
                let found = format!("{} {} {} {}", min.x, min.y, max.x, max.y);
                return Err(LoadError::Pattern { found });
            }
            Ok(Pattern {
                min_m: DVec2::ZERO,
                size_m,
            })
        })
        .transpose()?;
    let soil_z_m = soil.map(|z| z / per_metre - lower.z);
    let size_m = pattern.map_or(0.0, |pattern| pattern.size_m.max_element());
    let mut extent_m = size_m.max(soil_z_m.map_or(0.0, f64::abs));
    for vertex in joined.vertices() {
        *vertex -= lower;
        extent_m = extent_m.max(vertex.abs().max_element());
    }
    if extent_m > MAX_COORDINATE {
        return Err(LoadError::Extent { found: extent_m });
    }
    let mut canopy = Canopy::of_meshes(joined.meshes);
    canopy.organs = joined.organs;
    canopy.materials = joined.materials;
    canopy.origin_m = lower;
    canopy.pattern = pattern;
    canopy.soil_z_m = soil_z_m;
    Ok((canopy, joined.origins))
}

/// Files one after the other, organs and materials numbered through all of them.
#[derive(Default)]
struct Joined {
    meshes: Vec<Mesh>,
    triangles: usize,
    organs: Vec<Organ>,
    organ_numbers: HashMap<Organ, u32>,
    materials: Vec<Material>,
    material_numbers: HashMap<Material, u32>,
    origins: Origins,
}

impl Joined {
    fn add(&mut self, file: GeometryFile, species: &str) -> Result<(), LoadError> {
        let GeometryFile {
            file,
            mut mesh,
            line,
            organs,
            materials,
            ..
        } = file;
        let before = self.organs.len();
        let mut numbers = Vec::with_capacity(organs.len());
        for mut organ in organs {
            if organ.species.is_empty() {
                species.clone_into(&mut organ.species);
            }
            let number = numbered(&mut self.organ_numbers, &mut self.organs, organ);
            if (number as usize) < before && self.organs[number as usize] != Organ::soil() {
                let own = mesh.organ.iter().position(|&o| o as usize == numbers.len());
                let place = Place {
                    file,
                    line: own.and_then(|t| Some(*line.get(t)? as usize)),
                };
                return Err(self.twice(number, place));
            }
            numbers.push(number);
        }
        let organs = numbers;
        let material = |m| numbered(&mut self.material_numbers, &mut self.materials, m);
        let materials: Vec<u32> = materials.into_iter().map(material).collect();
        for (numbers, of) in [(&organs, &mut mesh.organ), (&materials, &mut mesh.material)] {
            of.iter_mut().for_each(|n| *n = numbers[*n as usize]);
        }
        self.origins.extend(file, self.triangles, line);
        self.triangles += mesh.len();
        self.meshes.push(mesh);
        Ok(())
    }

    /// The refusal of an organ that an earlier file has.
    fn twice(&self, organ: u32, again: Place) -> LoadError {
        let mut numbers = self.meshes.iter().flat_map(|mesh| &mesh.organ);
        let first = numbers.position(|&number| number == organ);
        LoadError::OrganTwice {
            again,
            organ: Box::new(self.organs[organ as usize].clone()),
            first: self.origins.place(first.unwrap_or_default()),
        }
    }

    fn vertices(&mut self) -> impl Iterator<Item = &mut DVec3> {
        self.meshes.iter_mut().flat_map(|mesh| &mut mesh.vertices)
    }
}
