//! The command line: one module a command, and what they share.

mod check;
mod console;
mod flags;
mod generate;
mod record;
mod solve;

use clap::{Parser, Subcommand};

pub(crate) use console::exit_code;

/// Computes how much light every leaf of a plant canopy absorbs.
///
/// A canopy is a list of triangles, alone or repeated for ever on a rectangle; leaves reflect and
/// transmit, each face in its own way, in as many wavelength bands as there are optics files. Results
/// are tables per organ, triangle and soil cell, with standard errors and an energy balance.
#[derive(Debug, Parser)]
#[command(name = "nestrad", version)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Solve(solve::SolveArgs),
    Check(check::CheckArgs),
    Generate(generate::GenerateArgs),
}
