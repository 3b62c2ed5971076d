//! Geometry at its ends: sizes, shapes, and places that surfaces share.

mod counts;
mod edges;
mod places;
mod sizes;

use glam::{DVec2, DVec3};
use nestrad_common::optics::LeafOptics;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::{Estimator, Settings};

use super::Case;
use super::judge::coarse;
use crate::scenery::Scenery;

const AXIS: &str = "Geometry";

/// Irradiance of the horizontal, W m⁻².
const SUN: f64 = 100.0;

fn by(estimator: Estimator) -> Settings {
    Settings {
        estimator,
        ..coarse()
    }
}

/// A right triangle that looks up, with legs along x and y.
fn flat(at: DVec3, legs: DVec2) -> [DVec3; 3] {
    [at, at + DVec3::X * legs.x, at + DVec3::Y * legs.y]
}

/// Ends a scene: one band and a sun in the zenith.
fn lit(mut scenery: Scenery, leaf: LeafOptics, soil_albedo: f64) -> Scene {
    scenery.band("B", soil_albedo, &[("leaf", leaf)]);
    scenery.source(-DVec3::Z, SUN);
    scenery.scene()
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = sizes::cases();
    cases.extend(places::cases());
    cases.extend(edges::cases());
    cases.extend(counts::cases());
    cases
}
