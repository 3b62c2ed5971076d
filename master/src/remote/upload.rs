//! A problem as the slices that a master takes.

use std::sync::Arc;

use nestrad_common::problem::Problem;
use nestrad_common::scene::{Material, Scene};
use nestrad_proto::{SLICE_BYTES, v1};
use v1::scene_header::Geometry;
use v1::scene_material::Kind;
use v1::scene_slice::Part;

/// Bytes of a triangle, as it travels.
const TRIANGLE_BYTES: usize = 9 * 8 + 8;

/// A scene whose geometry the master holds already.
pub(super) fn known(problem: &Problem, geometry_id: &str) -> v1::SceneSlice {
    header(problem, Geometry::GeometryId(geometry_id.to_owned()))
}

/// All slices of a scene, each made when the one before it is on its way.
pub(super) fn slices(problem: Arc<Problem>) -> impl Iterator<Item = v1::SceneSlice> + Send {
    let geometry = Geometry::NewGeometry(geometry(&problem.scene));
    let first = header(&problem, geometry);
    let of_organs = problem.clone();
    let mut next = 0;
    let organs = std::iter::from_fn(move || {
        let from = next;
        let slice = organs(&of_organs.scene, from);
        next += slice.id.len();
        (next > from).then_some(Part::Organs(slice))
    });
    let step = SLICE_BYTES / TRIANGLE_BYTES;
    let triangles = (0..problem.scene.triangles.len()).step_by(step);
    let triangles =
        triangles.map(move |from| Part::Triangles(triangle_slice(&problem.scene, from, step)));
    let rest = organs.chain(triangles);
    std::iter::once(first).chain(rest.map(|part| v1::SceneSlice { part: Some(part) }))
}

fn header(problem: &Problem, geometry: Geometry) -> v1::SceneSlice {
    let bands = problem.bands.iter().map(|band| v1::BandOptics {
        name: band.name.clone(),
        soil_albedo: band.soil_albedo,
        materials: band
            .materials
            .iter()
            .map(|optics| v1::MaterialOptics {
                rho_upper: optics.upper.rho,
                tau_upper: optics.upper.tau,
                rho_lower: optics.lower.rho,
                tau_lower: optics.lower.tau,
            })
            .collect(),
    });
    let sources = problem.sources.iter().map(|source| v1::ParallelSource {
        direction_x: source.direction.x,
        direction_y: source.direction.y,
        direction_z: source.direction.z,
        irradiance_w_m2: source.irradiance_W_m2.clone(),
    });
    let header = v1::SceneHeader {
        geometry: Some(geometry),
        bands: bands.collect(),
        sources: sources.collect(),
        sky_directions: problem.sky_directions as u32,
    };
    v1::SceneSlice {
        part: Some(Part::Header(header)),
    }
}

/// The scene stands at its local origin already: the master leaves it there, bit for bit.
fn geometry(scene: &Scene) -> v1::GeometryHeader {
    let materials = scene.materials.iter().enumerate();
    let materials = materials.map(|(number, material)| v1::SceneMaterial {
        // numbered, so that no two are the same
        name: format!("{number}: {material}"),
        kind: match material {
            Material::Stem { .. } => Kind::Stem,
            Material::Soil => Kind::Soil,
            Material::Leaf { .. } | Material::Named(_) => Kind::Leaf,
        }
        .into(),
    });
    v1::GeometryHeader {
        triangles: scene.triangles.len() as u64,
        organs: scene.organs.len() as u64,
        materials: materials.collect(),
        pattern: scene.pattern.map(|pattern| {
            let max_m = pattern.min_m + pattern.size_m;
            v1::PatternRectangle {
                min_x_m: pattern.min_m.x,
                min_y_m: pattern.min_m.y,
                max_x_m: max_m.x,
                max_y_m: max_m.y,
            }
        }),
        soil_z_m: scene.soil_z_m,
    }
}

fn organs(scene: &Scene, from: usize) -> v1::OrganSlice {
    let mut slice = v1::OrganSlice {
        first: from as u64,
        ..v1::OrganSlice::default()
    };
    let mut bytes = 0;
    for organ in &scene.organs[from..] {
        bytes += organ.id.len() + organ.plant.len() + 8;
        if bytes > SLICE_BYTES && !slice.id.is_empty() {
            break;
        }
        slice.id.push(organ.id.clone());
        slice.plant.push(organ.plant.clone());
    }
    slice
}

fn triangle_slice(scene: &Scene, from: usize, step: usize) -> v1::TriangleSlice {
    let to = (from + step).min(scene.triangles.len());
    let vertices = scene.triangles[from..to].iter().flatten();
    v1::TriangleSlice {
        first: from as u64,
        vertices_m: vertices.flat_map(|vertex| vertex.to_array()).collect(),
        organ: scene.organ[from..to].to_vec(),
        material: scene.material[from..to].to_vec(),
    }
}
