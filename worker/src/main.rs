//! `nestrad-worker`: computes near-field jobs for a master.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::Cli::run()
}
