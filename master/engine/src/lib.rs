//! The engine: it plans, traces a canopy once, and lights it again and again.
//!
//! [`traced::TracedCanopy::trace`] gives what knows no light, its `lit` a [`solution::Solution`];
//! [`rounds::solve_in_rounds`] does both until an accuracy is reached. Rows of the exchange come from a
//! [`exchange::RowSource`].
//!
//! This crate may import `nestrad-common`, the kernel, and libraries for numbers and threads: no network, no
//! protobuf, no command line, no files.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

pub mod account;
mod assemble;
pub mod causes;
pub mod direct;
pub mod exchange;
pub mod far_field;
pub mod frame;
pub mod heap;
pub mod lit_canopy;
mod outer_soil;
pub mod plan;
pub mod progress;
pub mod resident;
pub mod rounds;
pub mod run;
mod sensors;
pub mod series;
mod sinks;
pub mod solution;
mod solve_error;
pub mod solver;
pub mod stop;
pub mod stopwatch;
pub mod traced;
