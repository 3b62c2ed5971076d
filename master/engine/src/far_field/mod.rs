//! The far field: scattered light in a canopy described by horizontal layers.
//!
//! [`layers::Layers`] says what the layers hold; [`transport::solve`] gives the scattered radiance
//! between them, per level and polar bin. Equations, proofs and measured figures are in
//! `master/docs/far_field.md`.

mod adding;
mod beam;
mod layer_slab;
pub mod layers;
mod leaf;
mod matrix;
mod medium;
mod slab;
pub mod start;
pub mod transport;

#[cfg(test)]
mod tests;
