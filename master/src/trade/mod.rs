//! What speed costs in accuracy, measured on the user's own scene: the study behind `nestrad trade`.

mod axis;
mod bars;
pub mod choice;
mod error;
mod keys;
pub mod ledger;
pub mod measure;
mod pace;
mod page;
mod plot;
pub mod request;
pub mod setting;
pub mod study;
pub mod table;
mod terminal;

use std::path::Path;

pub use error::TradeError;

use crate::output::OutputError;
use crate::output::atomic::Staging;
use table::Comparison;

const TABLE: &str = "trade.csv";
const PAGE: &str = "trade.html";

/// What the page says of a study besides its numbers.
#[derive(Clone, Copy, Debug)]
pub struct About<'a> {
    /// What was studied.
    pub title: &'a str,
    /// Runs of each setting.
    pub runs: u32,
    /// Threads of each run.
    pub threads: usize,
}

/// Writes `trade.csv` and `trade.html` into a folder.
pub fn write(out: &Path, about: &About<'_>, comparison: &Comparison) -> Result<(), OutputError> {
    let mut staging = Staging::begin(out)?;
    staging.write(TABLE, |out| comparison.write_csv(out))?;
    staging.write(PAGE, |out| page::write(about, comparison, out))?;
    staging.commit(PAGE, &[])
}
