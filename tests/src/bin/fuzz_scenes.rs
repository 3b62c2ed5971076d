//! Random scenes through the door for input, `check` and a coarse solve, each with a time limit:
//! `fuzz_scenes SECONDS [FIRST SEED]`. Every second scene is a `doubled` one. A scene is its seed; what is found goes
//! into `tests/wild_scenes.rs`.

#![allow(clippy::print_stderr, reason = "a command that says how far it is")]

use std::env;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use nestrad_tests::extremes::run;
use nestrad_tests::extremes::wild::{UNBALANCED, case, doubled};

fn main() -> ExitCode {
    let number = |n: usize, default: u64| -> u64 {
        env::args()
            .nth(n)
            .and_then(|a| a.parse().ok())
            .unwrap_or(default)
    };
    let (end, first) = (
        Instant::now() + Duration::from_secs(number(1, 60)),
        number(2, 0),
    );
    let (mut seed, mut refused, mut unbalanced, mut failed) = (first, 0, 0, 0);
    while Instant::now() < end {
        let row = run(if seed % 2 == 0 {
            case(seed)
        } else {
            doubled(seed)
        });
        match &row.verdict {
            Ok(seen) if seen.happens == UNBALANCED => {
                unbalanced += 1;
                eprintln!("seed {seed}: {}", seen.figure);
            }
            Ok(seen) => refused += u64::from(seen.happens == "refused"),
            Err(fault) => {
                failed += 1;
                eprintln!("seed {seed}: {fault}");
            }
        }
        seed += 1;
    }
    let all = seed - first;
    eprintln!(
        "{all} scenes from seed {first}: {refused} refused, {unbalanced} out of balance, {failed} failed"
    );
    ExitCode::from(u8::from(failed > 0))
}
