//! The messages that master and workers exchange, generated from `nestrad/v1/*.proto`, which
//! documents them field by field.

#![allow(non_snake_case, reason = "units in names are written as units")]

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
