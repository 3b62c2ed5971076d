//! What can go wrong while results are written.

use std::io;
use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;
use thiserror::Error;

/// A result that could not be written. Files that were there before are as they were.
#[derive(Debug, Error)]
pub enum OutputError {
    /// A file or folder could not be written.
    #[error("cannot write {}", path.display())]
    File {
        /// The file or folder, as it was to be called in the end.
        path: PathBuf,
        /// Why not.
        #[source]
        fault: Fault,
    },
    /// Solution and canopy do not belong together.
    #[error("the solution does not fit the scene: {found} {what} instead of {expected}")]
    Mismatch {
        /// What was counted.
        what: &'static str,
        /// What the canopy asks for.
        expected: usize,
        /// What the solution has.
        found: usize,
    },
}

impl OutputError {
    pub(crate) fn at(path: &Path, fault: impl Into<Fault>) -> Self {
        Self::File {
            path: path.to_owned(),
            fault: fault.into(),
        }
    }
}

impl Fault {
    /// What the system said, where it was the system that refused, whoever wrote the file.
    pub fn io_kind(&self) -> Option<io::ErrorKind> {
        match self {
            Self::Io(error) => Some(error.kind()),
            Self::Json(error) => error.io_error_kind(),
            Self::Parquet(ParquetError::External(error)) => {
                let error = error.downcast_ref::<io::Error>();
                error.map(io::Error::kind)
            }
            _ => None,
        }
    }
}

/// Why a file could not be written.
#[derive(Debug, Error)]
pub enum Fault {
    /// The file system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// A number that is infinite or not a number; files hold finite numbers only.
    #[error("{place} is {value}, not a finite number")]
    NotFinite {
        /// Where it stands in the file.
        place: String,
        /// The number.
        value: f64,
    },
    /// There is something in the way of the new file.
    #[error("a folder of that name exists")]
    IsFolder,
    /// The Parquet encoder refused.
    #[error(transparent)]
    Parquet(#[from] ParquetError),
    /// The JSON encoder refused.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}
