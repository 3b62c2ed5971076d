//! Counts what is seen through a closed mesh: 1e8 lines and 1e7 rays.

#![allow(clippy::print_stderr, reason = "a command that says what it found")]

use std::process::ExitCode;

use nestrad_engine::plan::Estimator;
use nestrad_tests::leaks::{Leaks, OFFSETS_M, of_sphere};

fn main() -> ExitCode {
    let mut leaks = 0;
    for (estimator, effort, wanted) in [
        (Estimator::Lines, 0.01, 50_000_000),
        (Estimator::Rays, 64.0, 5_000_000),
    ] {
        for offset_m in OFFSETS_M {
            let (mut all, mut seed) = (Leaks::default(), 0);
            while all.sent < wanted {
                seed += 1;
                let found = of_sphere(offset_m, estimator, effort, seed);
                all.sent += found.sent;
                all.looks += found.looks;
                all.leaks += found.leaks;
            }
            eprintln!("{estimator:?} at {offset_m}: {all:?}");
            leaks += all.leaks;
        }
    }
    ExitCode::from(u8::from(leaks > 0))
}
