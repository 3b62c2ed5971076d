//! `nestrad`: light in plant canopies, from the command line.

use std::process::ExitCode;

fn main() -> ExitCode {
    nestrad_master::run()
}
