//! What keeps a report from being made.

use std::io;
use std::path::PathBuf;

use nestrad_common::assemble::LoadError;
use parquet::errors::ParquetError;
use thiserror::Error;

use crate::error::OutputError;

/// Why there is no report. Files that were there before are as they were.
#[derive(Debug, Error)]
pub enum ReportError {
    /// A file of the result cannot be read.
    #[error("{}: cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why not.
        #[source]
        source: io::Error,
    },
    /// The summary is missing: a solve that failed or is still at work.
    #[error("{}: expected a folder of results with a summary.json", folder.display())]
    NoResult {
        /// The folder.
        folder: PathBuf,
    },
    /// A table is missing.
    #[error("{}: expected {name}.csv or {name}.parquet, found neither", folder.display())]
    NoTable {
        /// The folder.
        folder: PathBuf,
        /// The table.
        name: String,
    },
    /// A Parquet table cannot be read.
    #[error("{}: expected a Parquet table", path.display())]
    Parquet {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: ParquetError,
    },
    /// The summary is not what a solve writes.
    #[error("{}: not the summary of a solve", path.display())]
    Summary {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: serde_json::Error,
    },
    /// A table is not what a solve writes.
    #[error("{}, row {row}: expected {expected}, found {found}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Counted from 1, the header being row 1.
        row: usize,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The canopy cannot be read again.
    #[error("the files of the canopy cannot be read; give their new place with --scene FILE")]
    Scene(#[source] LoadError),
    /// The canopy is not the one that was solved.
    #[error(
        "{scene}: not the canopy of the results in {}: {what}; give the right files with --scene FILE",
        out.display()
    )]
    OtherScene {
        /// Files of the canopy.
        scene: String,
        /// Folder of results.
        out: PathBuf,
        /// The first difference.
        what: String,
    },
    /// A picture was asked for in a band that there is not.
    #[error("{}: expected one of the bands {bands}, found {found}", out.display())]
    Band {
        /// Folder of results.
        out: PathBuf,
        /// All that there are.
        bands: String,
        /// What was asked for.
        found: String,
    },
    /// The page or the picture cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
}
