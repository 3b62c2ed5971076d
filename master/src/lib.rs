//! The master: it plans a solve, computes direct light and far field, solves for the radiosities of
//! all faces, and writes what came out; here, or as a service for others.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

pub mod cluster;
pub mod direct;
pub mod errors;
pub mod exchange;
pub mod far_field;
mod heap;
mod html;
pub mod order;
pub mod output;
pub mod plan;
pub mod remote;
pub mod report;
pub mod results;
pub mod rounds;
pub mod run;
pub mod service;
pub mod solution;
pub mod solver;
pub mod store;
pub mod trade;
pub mod world;
