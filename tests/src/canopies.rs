//! Generated canopies as scenes.

use std::collections::HashMap;
use std::num::NonZeroUsize;

use glam::DVec2;
use nestrad_common::canopy::{Material, Organ, Triangle};
use nestrad_common::generate::{Generated, LeafAngles, LeafShape, Maize, RandomCanopy, Stand};
use nestrad_common::light::{Sky, SkyLight, Source};
use nestrad_common::optics::{Band, FaceOptics, LeafOptics};

use crate::scenery::Scenery;

/// A generated canopy without bands and sources. Organs are leaves; the number of `leaf 0` (stems)
/// of a plant is its own organ, of a solid material.
pub fn unlit(generated: &Generated) -> Scenery {
    let mut scenery = Scenery {
        materials: vec![Material::Stem { species: 1 }, Material::Leaf { species: 1 }],
        pattern: Some(generated.pattern),
        soil_z_m: Some(generated.soil_z_m),
        ..Scenery::default()
    };
    let mut organs: HashMap<(u32, u32), u32> = HashMap::new();
    for (corners_m, label) in generated.triangles.iter().zip(&generated.labels) {
        let next = organs.len() as u32;
        let organ = *organs.entry((label.plant, label.leaf)).or_insert(next);
        if organ == next {
            scenery.organs.push(Organ {
                species: "1".to_owned(),
                plant: label.plant.to_string(),
                id: (1000 * label.plant + label.leaf).to_string(),
            });
        }
        scenery.triangles.push(Triangle {
            corners_m: *corners_m,
            organ,
            material: u32::from(label.leaf > 0),
        });
    }
    scenery
}

/// A generated canopy with one leaf material over a soil plane, under sources.
pub fn scenery(
    generated: &Generated,
    bands: &[(LeafOptics, f64)],
    sources: Vec<Source>,
) -> Scenery {
    let band = |&(leaf, soil_albedo): &(LeafOptics, f64)| Band {
        name: format!("rho {} tau {}", leaf.upper.rho, leaf.upper.tau),
        soil_albedo,
        materials: vec![
            LeafOptics::opaque(0.5 * (leaf.upper.rho + leaf.lower.rho)),
            leaf,
        ],
    };
    Scenery {
        bands: bands.iter().map(band).collect(),
        sources,
        ..unlit(generated)
    }
}

/// The directions of a uniform sky of 100 W m⁻² in every band, as sources that are meant as they are.
pub fn uniform_sky(directions: usize, bands: usize) -> Vec<Source> {
    let sky = sky(&Sky::UniformOvercast, bands);
    sky.sources(NonZeroUsize::new(directions).unwrap(), 1)
}

/// A sky of 100 W m⁻² in every band that has no sun.
pub fn sky(of: &Sky, bands: usize) -> SkyLight {
    let light = of.light(vec![100.0; bands]).unwrap();
    assert!(light.suns.is_empty());
    light.sky.unwrap()
}

/// Square leaves of 1 cm² or so in a layer of 2 m: a leaf is small against the distance that light
/// travels between leaves.
pub fn small_leaves(
    leaf_area_index: f64,
    angles: LeafAngles,
    leaf_m2: f64,
    seed: u64,
) -> Generated {
    RandomCanopy {
        leaf_area_index,
        angles,
        shape: LeafShape::Square,
        leaf_m2,
        size_m: DVec2::ONE,
        height_m: 3.0,
        seed,
    }
    .generate()
    .unwrap()
}

/// Four plants of maize with coarse leaves: 60 organs or so, a quick canopy of real shape.
pub fn small_maize() -> Generated {
    Maize {
        stand: Stand {
            rows: 2,
            plants_per_row: 2,
            row_spacing_m: 0.5,
            plant_spacing_m: 0.25,
        },
        leaf_triangle_m2: 4e-4,
        seed: 3,
    }
    .generate()
    .unwrap()
}

/// Leaves as the sample files have them: absorbing, and scattering most of what they get.
pub fn par_and_nir() -> [(LeafOptics, f64); 2] {
    let leaf = |upper: [f64; 2], lower: [f64; 2]| {
        let face = |[rho, tau]: [f64; 2]| FaceOptics { rho, tau };
        LeafOptics {
            upper: face(upper),
            lower: face(lower),
        }
    };
    [
        (leaf([0.09, 0.05], [0.11, 0.05]), 0.15),
        (leaf([0.44, 0.45], [0.46, 0.44]), 0.25),
    ]
}
