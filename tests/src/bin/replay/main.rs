//! How far the work of a solve can be spread: jobs of a large canopy are computed here, one thread each,
//! then their times and sizes are replayed through the real scheduler with simulated workers.
//!
//!     cargo run --release -p nestrad-tests --bin replay -- [--rows N] [--every N] [--times N]

#![allow(clippy::unwrap_used, reason = "a measurement that fails may stop")]
#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

mod record;
mod simulate;

use std::io::{Result, Write};

use clap::Parser;

use record::Recorded;
use simulate::{Network, simulate};

#[derive(Parser)]
struct Args {
    /// Rows of 40 plants of maize, of 1900 triangles or so each, beside as much bare soil
    #[arg(long, default_value_t = 14)]
    rows: u32,
    /// Of so many jobs one is computed; the others take its time and size
    #[arg(long, default_value_t = 8)]
    every: usize,
    /// Directions of the solve against those of the default accuracy: 25 for 0.1 %
    #[arg(long, default_value_t = 25)]
    times: u32,
}

const WORKERS: [u32; 8] = [1, 8, 32, 64, 128, 256, 384, 512];

fn main() -> Result<()> {
    let args = Args::parse();
    let mut out = std::io::stdout().lock();
    let recorded = Recorded::measure(args.rows, args.every);
    writeln!(out, "{recorded}")?;
    let whole = recorded.times(args.times);
    for gigabits in [10.0, 25.0, 100.0] {
        for held in [false, true] {
            let network = Network {
                bytes_per_s: gigabits * 1e9 / 8.0,
                latency_s: 1e-3,
                blocks_held: held,
            };
            writeln!(
                out,
                "\nnetwork of the master {gigabits} Gbit/s, blocks {}",
                if held { "held from before" } else { "fetched" }
            )?;
            writeln!(out, "workers  wall s  efficiency  busy network")?;
            for workers in WORKERS {
                let run = simulate(&whole, workers, network);
                writeln!(
                    out,
                    "{workers:7}  {:6.1}  {:9.1}%  {:11.1}%",
                    run.wall_s,
                    100.0 * run.efficiency,
                    100.0 * run.network
                )?;
            }
        }
    }
    Ok(())
}
