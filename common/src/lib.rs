//! What every part of nestrad shares: the scene, its optics and light, the files they come in, and
//! the projection lattice. No network and no solving here.
//!
//! Units inside are metres and W m⁻²; z points up. See [`scene::Scene`] for the conventions.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

pub mod above;
pub mod assemble;
pub mod directions;
pub mod elements;
pub mod ends;
pub mod formats;
pub mod generate;
pub mod geometry;
pub mod inputs;
pub mod inspection;
pub mod lattice;
pub mod light;
pub mod optics;
pub mod options;
pub mod problem;
pub mod scene;
