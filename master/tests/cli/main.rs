//! The real binary, run as a user runs it.

mod checks;
mod desk;
mod generated;
mod help;
mod refusals;
mod results;
