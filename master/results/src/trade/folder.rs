//! A study as files.

use std::path::Path;

use super::page::{self, About};
use super::table::Comparison;
use crate::atomic::{Staging, check_writable};
use crate::error::OutputError;

const TABLE: &str = "trade.csv";
const PAGE: &str = "trade.html";
/// Every run, one a line.
pub(super) const RECORDS: &str = "trade.jsonl";

/// Refuses a folder that a study could not be written into; for its beginning.
pub fn check_place(out: &Path) -> Result<(), OutputError> {
    check_writable(out, &[TABLE, PAGE, RECORDS])
}

/// Writes `trade.csv` and `trade.html` into a folder.
pub fn write(out: &Path, about: &About<'_>, comparison: &Comparison) -> Result<(), OutputError> {
    let mut staging = Staging::begin(out)?;
    staging.write(TABLE, |out| comparison.write_csv(out))?;
    staging.write(PAGE, |out| page::write(about, comparison, out))?;
    staging.commit(PAGE, &[])
}
