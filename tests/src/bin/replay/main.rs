//! How far the work of a solve can be spread: jobs of a large canopy are computed here, one thread each,
//! then their times and sizes are replayed through the real scheduler with simulated workers.
//!
//!     cargo run --release -p nestrad-tests --bin replay -- [--rows N] [--dense] [--every N] [--accuracy PERCENT]

#![allow(clippy::unwrap_used, reason = "a measurement that fails may stop")]
#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

mod record;
mod simulate;

use std::io::{Result, Write};

use clap::Parser;

use record::{Field, Recorded};
use simulate::{Setting, simulate};

#[derive(Parser)]
struct Args {
    /// Rows of 40 plants of maize, of 4300 triangles or so each, beside as much bare soil
    #[arg(long, default_value_t = 7)]
    rows: u32,
    /// Of so many jobs of a kind one is computed, past the first batch; the others take its time and size
    #[arg(long, default_value_t = 64)]
    every: usize,
    /// Without the bare soil
    #[arg(long)]
    dense: bool,
    /// Of the solve, percent
    #[arg(long, default_value_t = 0.1)]
    accuracy: f64,
}

const WORKERS: [u32; 7] = [1, 8, 32, 64, 128, 256, 512];

/// Of the master, Gbit/s.
const LINKS: [f64; 3] = [10.0, 25.0, 100.0];

/// More than ever wait for one another.
const ENOUGH: u32 = 1 << 20;

/// Threads of a worker, whether it holds the block from an earlier solve, threads of the master.
const KINDS: [(u32, bool, u32, &str); 5] = [
    (1, false, ENOUGH, "workers of one thread, blocks fetched"),
    (1, true, ENOUGH, "workers of one thread, blocks held"),
    (32, false, ENOUGH, "workers of 32 threads, blocks fetched"),
    (32, false, 32, "the same, joined by a master of 32 threads"),
    (
        32,
        false,
        128,
        "the same, joined by a master of 128 threads",
    ),
];

fn main() -> Result<()> {
    let args = Args::parse();
    let mut out = std::io::stdout().lock();
    let field = Field {
        rows: args.rows,
        dense: args.dense,
        accuracy_percent: args.accuracy,
    };
    let recorded = Recorded::measure(field, args.every);
    writeln!(out, "{recorded}")?;
    for (threads_each, blocks_held, master_threads, title) in KINDS {
        writeln!(
            out,
            "\n{title}: threads, wall s, efficiency % at 10, 25, 100 Gbit/s"
        )?;
        for threads in WORKERS.into_iter().filter(|n| n % threads_each == 0) {
            write!(out, "{threads:7}")?;
            for gigabits in LINKS {
                let setting = Setting {
                    workers: threads / threads_each,
                    threads_each,
                    bytes_per_s: gigabits * 1e9 / 8.0,
                    latency_s: 1e-3,
                    blocks_held,
                    master_threads,
                };
                let run = simulate(&recorded, setting);
                let percent = 100.0 * run.efficiency;
                write!(out, "  {:7.2} {percent:5.1}", run.wall_s)?;
            }
            writeln!(out)?;
        }
    }
    Ok(())
}
