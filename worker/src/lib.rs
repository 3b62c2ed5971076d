//! The worker: it joins a master, leases near-field jobs, runs the kernel and returns the rows.
//!
//! This crate may import the kernel and the protocol, and nothing of the master.

mod cli;
pub mod serving;

use std::process::ExitCode;

/// The program `nestrad-worker`: its whole life, by the command line of this process.
pub fn run() -> ExitCode {
    cli::Cli::run()
}
