//! The messages that master, workers and clients exchange, generated from `nestrad/v1/*.proto`, which
//! documents them field by field, and the channels that they travel on. And what master and worker have in common as
//! processes: the [`log`], what is said of their [`usage`], and the [`parent`] that they may have.
//!
//! This crate may import the kernel and `nestrad-common`; [`near_field`] turns their types into messages and back.

#![allow(non_snake_case, reason = "units in names are written as units")]

pub mod access;
pub mod authority;
pub mod channel;
pub mod connections;
pub mod guard;
pub mod log;
mod mesh;
pub mod near_field;
pub mod parent;
pub mod reason;
pub mod token;
pub mod usage;

/// Version 1 of the protocol.
pub mod v1 {
    #![allow(
        missing_docs,
        reason = "generated: the .proto files document every field"
    )]
    #![allow(clippy::all, reason = "generated")]
    include!(concat!(env!("OUT_DIR"), "/nestrad.v1.rs"));
}

/// All `.proto` files as an encoded `FileDescriptorSet`: what the reflection service shows, and what
/// stubs in other languages can be made from.
pub const DESCRIPTORS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/descriptors.bin"));

/// No message is larger than this, bytes.
pub const MAX_MESSAGE_BYTES: usize = 8 << 20;

/// The largest slice of something that travels in slices, bytes, about.
pub const SLICE_BYTES: usize = 512 << 10;

/// The metadata of an error that goes away: after so many seconds the same call may succeed.
pub const RETRY_AFTER: &str = "retry-after";
