//! The layer model against known answers.

mod closed_forms;
mod extremes;
mod figures;
mod monte_carlo;
mod properties;
mod scene;

use std::num::NonZeroUsize;

use glam::DVec3;
use nestrad_common::light::Source;
use nestrad_common::optics::{Band, LeafOptics};

use super::layers::{Foliage, Layers};
use super::transport::{self, Field};

fn nonzero(n: usize) -> NonZeroUsize {
    NonZeroUsize::new(n).expect("a test asks for at least one")
}

/// A homogeneous canopy: the same leaves in each of `n` layers. `leaves`: inclination's cosine,
/// whether the lower face is up, area index of the whole canopy. One class and material each.
fn homogeneous(n: usize, leaves: &[(f64, bool, f64)]) -> Layers {
    let layer = leaves.iter().enumerate().map(|(i, leaf)| Foliage {
        class: i as u32,
        material: 0,
        lower_face_up: leaf.1,
        area_index: leaf.2 / n as f64,
    });
    Layers {
        bottom_z_m: 0.0,
        top_z_m: 1.0,
        ground_area_m2: 1.0,
        class_cosine: leaves.iter().map(|leaf| leaf.0).collect(),
        foliage: vec![layer.collect(); n],
    }
}

/// Leaves of all orientations alike, in `classes` classes.
fn spherical(n: usize, area_index: f64, classes: usize) -> Layers {
    let leaves: Vec<_> = (0..classes)
        .map(|i| (i as f64 + 0.5) / classes as f64)
        .map(|c| (c, false, area_index / classes as f64))
        .collect();
    homogeneous(n, &leaves)
}

fn source(mu: f64, irradiance: f64) -> Source {
    Source {
        direction: DVec3::new((1.0 - mu * mu).sqrt(), 0.0, -mu),
        irradiance_W_m2: vec![irradiance],
    }
}

fn solve(
    layers: &Layers,
    leaf: LeafOptics,
    sources: &[Source],
    soil: Option<f64>,
    bins: usize,
) -> Field {
    let band = Band {
        name: "test".into(),
        soil_albedo: soil.unwrap_or(0.0),
        materials: vec![leaf],
    };
    transport::solve(layers, &band, 0, sources, soil, nonzero(bins))
}

/// Incoming less absorbed and escaped, relative to incoming.
fn closure(field: &Field, soil: Option<f64>) -> f64 {
    let absorbed: f64 = field.absorbed_W_m2.iter().sum();
    let ground = (1.0 - soil.unwrap_or(0.0)) * field.transmitted_W_m2;
    1.0 - (absorbed + field.reflected_W_m2 + ground) / field.incoming_W_m2
}

fn close(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b} +- {tolerance}");
}
