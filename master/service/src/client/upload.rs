//! A scene as the slices that a master takes.

use glam::DVec3;
use nestrad_common::canopy::{Canopy, Kind};
use nestrad_common::light::SkyLight;
use nestrad_common::light::{CieType, Radiance};
use nestrad_common::scene::Scene;
use nestrad_proto::{SLICE_BYTES, v1};
use v1::scene_header::Geometry;
use v1::scene_material::Kind as Sent;
use v1::scene_slice::Part;

/// Bytes of a triangle, as it travels.
const TRIANGLE_BYTES: usize = 9 * 8 + 8;

/// A scene whose geometry the master holds already.
pub(super) fn known(scene: &Scene, geometry_id: &str) -> v1::SceneSlice {
    header(scene, Geometry::GeometryId(geometry_id.to_owned()))
}

/// All slices of a scene, each made when the one before it is on its way.
pub(super) fn slices(scene: &Scene) -> impl Iterator<Item = v1::SceneSlice> + Send + use<> {
    let geometry = Geometry::NewGeometry(geometry(&scene.canopy));
    let first = header(scene, geometry);
    let (canopy, of_organs) = (scene.canopy.clone(), scene.canopy.clone());
    let mut next = 0;
    let organs = std::iter::from_fn(move || {
        let from = next;
        let slice = organs(&of_organs, from);
        next += slice.id.len();
        (next > from).then_some(Part::Organs(slice))
    });
    let step = SLICE_BYTES / TRIANGLE_BYTES;
    let triangles = (0..canopy.len()).step_by(step);
    let triangles = triangles.map(move |from| Part::Triangles(triangle_slice(&canopy, from, step)));
    let rest = organs.chain(triangles);
    std::iter::once(first).chain(rest.map(|part| v1::SceneSlice { part: Some(part) }))
}

fn header(scene: &Scene, geometry: Geometry) -> v1::SceneSlice {
    let bands = scene.optics.bands.iter().map(|band| v1::BandOptics {
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
    let sources = scene.light.suns.iter().map(|source| v1::ParallelSource {
        direction_x: source.direction.x,
        direction_y: source.direction.y,
        direction_z: source.direction.z,
        irradiance_w_m2: source.irradiance_W_m2.clone(),
    });
    let header = v1::SceneHeader {
        geometry: Some(geometry),
        bands: bands.collect(),
        sources: sources.collect(),
        sky: scene.light.sky.as_ref().map(sky),
    };
    v1::SceneSlice {
        part: Some(Part::Header(header)),
    }
}

fn sky(light: &SkyLight) -> v1::SkyLight {
    use v1::sky_light::Radiance as Sent;
    v1::SkyLight {
        radiance: Some(match light.radiance {
            Radiance::Uniform => Sent::Uniform(v1::UniformSky {}),
            Radiance::MoonSpencer => Sent::MoonSpencer(v1::MoonSpencerSky {}),
            Radiance::Cie { kind, towards_sun } if kind == CieType::CLEAR => {
                Sent::CieClear(v1::CieClearSky {
                    towards_sun: Some(vector(towards_sun)),
                })
            }
            Radiance::Cie { kind, towards_sun } => Sent::Cie(v1::CieSky {
                r#type: kind.number().into(),
                towards_sun: Some(vector(towards_sun)),
            }),
            Radiance::Perez(perez) => Sent::Perez(v1::PerezSky {
                towards_sun: Some(vector(perez.towards_sun)),
                clearness: perez.clearness,
                brightness: perez.brightness,
            }),
        }),
        irradiance_w_m2: light.irradiance_W_m2.clone(),
        diffuse_fraction: light.diffuse_fraction,
    }
}

fn vector(DVec3 { x, y, z }: DVec3) -> v1::Vector {
    v1::Vector { x, y, z }
}

/// The canopy stands at its local origin already: the master leaves it there, bit for bit.
fn geometry(canopy: &Canopy) -> v1::GeometryHeader {
    let kinds = canopy.kinds().into_iter().zip(canopy.may_be_solid());
    let materials = canopy.materials.iter().zip(kinds).enumerate();
    let materials = materials.map(|(number, (material, (kind, solid)))| v1::SceneMaterial {
        // numbered, so that no two are the same
        name: format!("{number}: {material}"),
        kind: match kind {
            Kind::Leaf => Sent::Leaf,
            Kind::Stem => Sent::Stem,
            Kind::Structure => Sent::Structure,
            Kind::Soil => Sent::Soil,
        }
        .into(),
        solid: Some(solid),
    });
    v1::GeometryHeader {
        triangles: canopy.len() as u64,
        organs: canopy.organs.len() as u64,
        materials: materials.collect(),
        pattern: canopy.pattern.map(|pattern| {
            let max_m = pattern.min_m + pattern.size_m;
            v1::PatternRectangle {
                min_x_m: pattern.min_m.x,
                min_y_m: pattern.min_m.y,
                max_x_m: max_m.x,
                max_y_m: max_m.y,
            }
        }),
        soil_z_m: canopy.soil_z_m,
    }
}

fn organs(canopy: &Canopy, from: usize) -> v1::OrganSlice {
    let mut slice = v1::OrganSlice {
        first: from as u64,
        ..v1::OrganSlice::default()
    };
    let mut bytes = 0;
    for organ in &canopy.organs[from..] {
        bytes += organ.id.len() + organ.plant.len() + organ.species.len() + 12;
        if bytes > SLICE_BYTES && !slice.id.is_empty() {
            break;
        }
        slice.id.push(organ.id.clone());
        slice.plant.push(organ.plant.clone());
        slice.species.push(organ.species.clone());
    }
    slice
}

fn triangle_slice(canopy: &Canopy, from: usize, step: usize) -> v1::TriangleSlice {
    let to = (from + step).min(canopy.len());
    let triangles = || (from..to).map(|t| canopy.triangle(t));
    let vertices = triangles().flat_map(|t| t.corners_m);
    v1::TriangleSlice {
        first: from as u64,
        vertices_m: vertices.flat_map(|vertex| vertex.to_array()).collect(),
        organ: triangles().map(|t| t.organ).collect(),
        material: triangles().map(|t| t.material).collect(),
    }
}
