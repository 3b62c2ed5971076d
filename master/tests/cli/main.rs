//! The real binary, run as a user runs it.

#![allow(clippy::unwrap_used, reason = "what cannot be set up fails the test")]

mod checks;
mod desk;
mod endless;
mod generated;
mod help;
mod inputs;
mod kinds;
mod minus_zero;
mod refusals;
mod results;
mod series;
mod trades;
