//! A study as files.

use std::path::Path;

use super::page::{self, About};
use super::table::Comparison;
use crate::atomic::Staging;
use crate::error::OutputError;

const TABLE: &str = "trade.csv";
const PAGE: &str = "trade.html";

/// Writes `trade.csv` and `trade.html` into a folder.
pub fn write(out: &Path, about: &About<'_>, comparison: &Comparison) -> Result<(), OutputError> {
    let mut staging = Staging::begin(out)?;
    staging.write(TABLE, |out| comparison.write_csv(out))?;
    staging.write(PAGE, |out| page::write(about, comparison, out))?;
    staging.commit(PAGE, &[])
}
