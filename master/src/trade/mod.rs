//! What speed costs in accuracy, measured on the user's own scene: the study behind `nestrad trade`.

pub mod choice;
mod error;
pub mod ledger;
pub mod measure;
mod pace;
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

/// Writes `trade.csv` into a folder.
pub fn write(out: &Path, comparison: &Comparison) -> Result<(), OutputError> {
    let mut staging = Staging::begin(out)?;
    staging.write(TABLE, |out| comparison.write_csv(out))?;
    staging.commit(TABLE, &[])
}
