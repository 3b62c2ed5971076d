//! The command line of nestrad: one file a command. The program is this crate's [`run`], so that the Python package can
//! bring it along.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

mod cli;

use std::process::ExitCode;

use clap::Parser;

use cli::{Cli, Command};

/// The program `nestrad`: its whole life, by the command line of this process.
pub fn run() -> ExitCode {
    nestrad_engine::heap::settle();
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command,
        Err(usage) => return cli::code_of(|| Err(usage.into())),
    };
    cli::code_of(|| match command {
        Command::Solve(args) => args.run(),
        Command::Check(args) => args.run(),
        Command::Generate(args) => args.run(),
        Command::Report(args) => args.run(),
        Command::Series(args) => args.run(),
        Command::Day(args) => args.run(),
        Command::Serve(args) => args.run(),
        Command::Status(args) => args.run(),
        Command::Trade(args) => args.run(),
    })
}
