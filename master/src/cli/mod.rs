//! The command line: one module a command, and what they share.

mod bar;
mod check;
mod console;
mod exit;
mod flags;
mod generate;
mod numbers;
mod pool;
mod record;
mod remote;
mod report;
mod series;
mod serve;
mod settings;
mod solve;
mod state;
mod status;
mod trade;
mod workers;

use clap::{Parser, Subcommand};

pub(crate) use exit::code_of;

/// Computes how much light every leaf of a plant canopy absorbs.
///
/// A canopy is a list of triangles that stands alone or repeats on a rectangle without end. Each face of a leaf
/// has its own reflectance and transmittance, in as many wavelength bands as there are optics files. Results
/// are tables per organ, triangle and soil cell, with standard errors and an energy balance.
#[derive(Debug, Parser)]
#[command(name = "nestrad", version)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Solve(Box<solve::SolveArgs>),
    Check(check::CheckArgs),
    Generate(generate::GenerateArgs),
    Report(report::ReportArgs),
    Series(Box<series::SeriesArgs>),
    Day(Box<series::DayArgs>),
    Serve(serve::ServeArgs),
    Status(status::StatusArgs),
    Trade(Box<trade::TradeArgs>),
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn every_option_is_explained() {
        fn check(command: &clap::Command) {
            assert!(command.get_about().is_some(), "{}", command.get_name());
            for arg in command.get_arguments() {
                let help = arg.get_help().map(ToString::to_string);
                assert!(help.is_some_and(|text| !text.is_empty()), "{arg}");
            }
            command.get_subcommands().for_each(check);
        }
        Cli::command().debug_assert();
        check(&Cli::command());
    }
}
