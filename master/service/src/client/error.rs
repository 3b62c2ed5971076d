//! Why a master gives no solution.

use thiserror::Error;

/// Why there is no solution.
#[derive(Debug, Error)]
pub enum RemoteError {
    /// The master refused.
    #[error("the master cannot {doing}: {message}")]
    Refused {
        /// What it was asked for.
        doing: &'static str,
        /// What it said.
        message: String,
    },
    /// The master is not there.
    #[error("the master cannot be reached: {message}")]
    Lost {
        /// What the last try came to.
        message: String,
    },
    /// The master could not solve it.
    #[error("the solve failed: {reason}")]
    Failed {
        /// Why.
        reason: String,
    },
    /// Somebody stopped it.
    #[error("the solve was cancelled")]
    Cancelled,
    /// What the master sent is not what was asked for.
    #[error("the master sent {0}")]
    Answer(&'static str),
}
