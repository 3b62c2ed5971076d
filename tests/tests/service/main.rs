//! The master as a service: real processes, real sockets.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]
#![allow(clippy::unwrap_used, reason = "what cannot be set up fails the test")]

mod access;
mod clients;
mod connections;
mod endless;
mod garbage;
mod light;
mod limits;
mod logs;
mod many_solves;
mod missed;
mod neighbours;
mod numbers;
mod python;
mod residents;
mod results;
mod stopping;
