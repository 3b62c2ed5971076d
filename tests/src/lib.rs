//! What the tests share: scenes built by hand, solves, form factors counted from rows, statistics; the
//! programs as processes, and calls of a master. Where an answer comes from is said in the test that
//! needs it.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]
#![allow(
    clippy::unwrap_used,
    reason = "this crate is used by tests only, where a panic is a failure"
)]

pub mod adding;
pub mod calls;
pub mod canopies;
pub mod chart;
pub mod crew;
pub mod cutting;
pub mod desk;
pub mod enclosure;
pub mod extremes;
pub mod files;
pub mod form_factor;
pub mod leaks;
pub mod lies;
pub mod processes;
pub mod proxy;
pub mod random;
pub mod reference;
pub mod rogue;
pub mod scenery;
pub mod solving;
pub mod statistics;
