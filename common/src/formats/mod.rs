//! The files that a user brings, one module per format.
//!
//! Parsers take the bytes of a file and the name to give it in messages; only [`read`] touches the
//! file system. Whatever the bytes are, no parser panics, and the memory it takes is in
//! proportion to its input; every error says where it is, what was expected and what was found.

pub mod can;
mod error;
mod geometry_file;
pub mod light;
mod lines;
#[cfg(test)]
mod mutation_tests;
pub mod obj;
pub mod opt;
mod origins;
pub mod pattern;
pub mod polygon;
pub mod read;
pub mod scene_file;
pub mod weather;

pub use error::{FormatError, Place};
pub(crate) use geometry_file::numbered;
pub use geometry_file::{GeometryFile, MAX_COORDINATE, MAX_TRIANGLES};
pub use origins::Origins;
