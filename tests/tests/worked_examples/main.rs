//! The worked examples of `master/docs/architecture.md`, kept compiling and true.

#![allow(clippy::unwrap_used)]

mod column_grid;
mod recorded_rows;

use nestrad_common::options::Diameter;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_tests::canopies::{par_and_nir, scenery, small_maize, uniform_sky};

/// A small canopy that repeats, in PAR and NIR under a sky.
fn maize() -> Scene {
    scenery(&small_maize(), &par_and_nir(), uniform_sky(12, 2)).scene()
}

/// Settings with a sphere of near exchange of half a metre, so that there is a far field.
fn within_a_sphere() -> Settings {
    Settings {
        accuracy_percent: 1.5,
        diameter: Diameter::Metres(0.5),
        ..Settings::default()
    }
}
