//! What can keep a canopy from being written.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::light::sky::SkyError;

/// Why a canopy could not be written.
#[derive(Debug, Error)]
pub enum WriteError {
    /// The disk, or the rights to it.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder that could not be written.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Something of that name is there that is not as it was generated.
    #[error(
        "{}: was not made by nestrad generate, or was changed since; expected --force to overwrite \
         it, or another --out",
        path.display()
    )]
    Foreign {
        /// The first such file.
        path: PathBuf,
    },
    /// The light could not be made.
    #[error(transparent)]
    Light(#[from] SkyError),
}
