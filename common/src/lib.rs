//! What every part of nestrad shares: canopy, optics and light, the files they come in, generators, units.
//! No network and no solving here: this crate imports no other of the project.
//!
//! Units inside are metres and W m⁻²; z points up. See [`canopy::Canopy`] for the conventions.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

pub mod assemble;
pub mod bounded;
pub mod canopy;
pub mod figures;
pub mod formats;
pub mod generate;
pub mod geometry;
pub mod inputs;
pub mod inspection;
pub mod light;
pub mod optics;
pub mod options;
pub mod panics;
pub mod printable;
pub mod scene;
pub mod sensors;
pub mod threads;
pub mod weather;
