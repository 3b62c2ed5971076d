//! Made-up canopies, so that there is something to compute where no other data is at hand.
//!
//! Every generator is a struct of parameters with a seed. The same parameters give the same
//! canopy, vertex for vertex. Plants are plausible, not calibrated on any cultivar.

mod angles;
mod bean;
mod blade;
mod canopy;
mod dice;
mod drafts;
mod error;
mod folder;
mod maize;
mod random;
mod stand;
mod tube;

pub use angles::{LeafAngles, LeafAnglesError};
pub use bean::Bean;
pub use canopy::{Generated, Label};
pub use error::WriteError;
pub use folder::Overwrite;
pub use maize::Maize;
pub use random::{LeafShape, RandomCanopy};
pub use stand::Stand;

use thiserror::Error;

/// A parameter that no canopy can be made from.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{name} is {given}: expected {expected}")]
pub struct GenerateError {
    /// The parameter, in words.
    pub name: &'static str,
    /// As given.
    pub given: f64,
    /// What would do.
    pub expected: &'static str,
}

/// Refuses a parameter that does not satisfy `holds`.
fn check(
    holds: bool,
    name: &'static str,
    given: f64,
    expected: &'static str,
) -> Result<(), GenerateError> {
    if holds {
        Ok(())
    } else {
        Err(GenerateError {
            name,
            given,
            expected,
        })
    }
}

/// Refuses an area of leaf triangles that would give absurd meshes.
fn check_leaf_triangle(area_m2: f64) -> Result<(), GenerateError> {
    check(
        (1e-7..=1e-2).contains(&area_m2),
        "area of leaf triangles in m2",
        area_m2,
        "1e-7 to 1e-2",
    )
}

#[cfg(test)]
mod tests;
