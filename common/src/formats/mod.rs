//! The files that a user brings, one module per format.
//!
//! Parsers take the bytes of a file and the name to give it in messages; only [`read`] touches the
//! file system. No parser panics or allocates more than a small multiple of its input, whatever the
//! bytes are; every error says where it is, what was expected and what was found.

pub mod can;
mod error;
pub mod light;
mod lines;
mod mesh;
pub mod obj;
pub mod opt;
pub mod pattern;
pub mod read;
pub mod scene_file;

pub use error::{FormatError, Place};
pub(crate) use mesh::numbered;
pub use mesh::{MAX_COORDINATE, MAX_TRIANGLES, Mesh};
