//! `nestrad-worker`: computes near-field jobs for a master.

use std::process::ExitCode;

fn main() -> ExitCode {
    nestrad_worker::run()
}
