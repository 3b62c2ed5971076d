//! The master as a gRPC service, and the client that asks it.
//!
//! This crate may import the engine, the cluster and the protocol; it knows no command line and writes no files.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

pub mod client;
pub mod server;
