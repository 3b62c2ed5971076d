//! Meshes to a scene: one list of triangles, in metres, from a local origin.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::LoadError;
use crate::formats::pattern::Rectangle;
use crate::formats::{MAX_COORDINATE, MAX_TRIANGLES, Mesh, Place, numbered};
use crate::options::Unit;
use crate::scene::{Pattern, Scene};

/// The geometry of a scene as the user gave it.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// One per file.
    pub meshes: Vec<Mesh>,
    /// Where the canopy repeats, in `unit`.
    pub pattern: Option<Rectangle>,
    /// Height of the soil plane, in `unit`.
    pub soil: Option<f64>,
    /// Of all of it.
    pub unit: Unit,
}

/// Where each triangle of a scene was read.
#[derive(Clone, Debug, Default)]
pub struct Origins {
    /// Name of a file and the number of its first triangle, in the order of the triangles.
    files: Vec<(String, usize)>,
    lines: Vec<u32>,
}

impl Origins {
    /// The file and line of a triangle; its number where it did not come from a file.
    pub fn place(&self, triangle: usize) -> Place {
        if self.files.is_empty() {
            return Place::file(&format!("triangle {triangle}"));
        }
        let next = self.files.partition_point(|&(_, first)| first <= triangle);
        let file = next.checked_sub(1).map(|index| self.files[index].0.clone());
        Place {
            file: file.unwrap_or_default(),
            line: self.lines.get(triangle).map(|&line| line as usize),
        }
    }

    /// Where a material is used first.
    pub(super) fn first_use(&self, scene: &Scene, material: u32) -> Place {
        let first = scene.material.iter().position(|&used| used == material);
        self.place(first.unwrap_or_default())
    }
}

/// Joins the meshes, converts to metres and moves everything to a local origin: the lower corner of
/// the pattern, or else of the scene, at the height of the scene's lowest vertex. There a double
/// resolves every leaf, and nothing later needs to know how far away the user's origin is.
///
/// Organs and materials of the same name are the same, whichever file they come from.
pub fn build_scene(geometry: Geometry) -> Result<(Scene, Origins), LoadError> {
    let Geometry {
        meshes,
        pattern,
        soil,
        unit,
    } = geometry;
    let files = || {
        let names: Vec<&str> = meshes.iter().map(|mesh| mesh.file.as_str()).collect();
        names.join(", ")
    };
    let total: usize = meshes.iter().map(|mesh| mesh.triangles.len()).sum();
    if total == 0 {
        return Err(LoadError::EmptyScene { files: files() });
    }
    if total > MAX_TRIANGLES {
        let (files, found) = (files(), total);
        return Err(LoadError::TooManyTriangles { files, found });
    }
    let proper = |z: &f64| z.is_finite() && z.abs() <= MAX_COORDINATE;
    if let Some(found) = soil.filter(|z| !proper(z)) {
        return Err(LoadError::SoilHeight { found });
    }

    let (mut scene, origins) = joined(meshes);
    let per_metre = unit.per_metre();
    let mut lower = DVec3::INFINITY;
    for vertex in scene.triangles.iter_mut().flatten() {
        *vertex /= per_metre;
        lower = lower.min(*vertex);
    }
    if let Some(pattern) = pattern {
        let min = pattern.min / per_metre;
        lower = min.extend(lower.z);
        scene.pattern = Some(Pattern {
            min_m: DVec2::ZERO,
            size_m: pattern.max / per_metre - min,
        });
    }
    for vertex in scene.triangles.iter_mut().flatten() {
        *vertex -= lower;
    }
    scene.origin_m = lower;
    scene.soil_z_m = soil.map(|z| z / per_metre - lower.z);
    Ok((scene, origins))
}

fn joined(meshes: Vec<Mesh>) -> (Scene, Origins) {
    let mut scene = Scene::default();
    let mut origins = Origins::default();
    let (mut organs, mut materials) = (HashMap::new(), HashMap::new());
    for mesh in meshes {
        let organ: Vec<u32> = mesh
            .organs
            .into_iter()
            .map(|organ| numbered(&mut organs, &mut scene.organs, organ))
            .collect();
        let material: Vec<u32> = mesh
            .materials
            .into_iter()
            .map(|material| numbered(&mut materials, &mut scene.materials, material))
            .collect();
        origins.files.push((mesh.file, scene.triangles.len()));
        extend(&mut origins.lines, mesh.line);
        extend(&mut scene.triangles, mesh.triangles);
        let local = |numbers: &[u32], of: Vec<u32>| -> Vec<u32> {
            of.into_iter()
                .map(|index| numbers[index as usize])
                .collect()
        };
        extend(&mut scene.organ, local(&organ, mesh.organ));
        extend(&mut scene.material, local(&material, mesh.material));
    }
    (scene, origins)
}

/// Appends; a first list is taken over as it is.
fn extend<T>(list: &mut Vec<T>, more: Vec<T>) {
    if list.is_empty() {
        *list = more;
    } else {
        list.extend(more);
    }
}
