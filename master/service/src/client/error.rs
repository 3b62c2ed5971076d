//! Why a master gives no solution.

use nestrad_engine::traced::FailureKind;
use thiserror::Error;
use tonic::Code;

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
        /// What kind of refusal it is.
        kind: RefusalKind,
    },
    /// The master had no room, for as long as one waits for it.
    #[error("the master cannot {doing}: {message}; it had no room for {waited_s} s")]
    Busy {
        /// What it was asked for.
        doing: &'static str,
        /// What it said last.
        message: String,
        /// For how long it was asked.
        waited_s: u64,
    },
    /// The master, or this client, is not who the other expects.
    #[error("{message}")]
    Credentials {
        /// Whose certificate is refused, and why.
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
        /// What kind of thing went wrong.
        kind: FailureKind,
    },
    /// Somebody stopped it.
    #[error("the solve was cancelled")]
    Cancelled,
    /// What the master sent is not what was asked for.
    #[error("the master sent {0}")]
    Answer(&'static str),
}

/// What kind of refusal an answer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RefusalKind {
    /// What was sent cannot be.
    Input,
    /// A limit of the master does not allow it.
    Limit,
    /// The master is not there, or not for this caller.
    Master,
}

impl RefusalKind {
    /// By the code of an answer.
    pub fn of(code: Code) -> Self {
        match code {
            Code::InvalidArgument | Code::OutOfRange => Self::Input,
            Code::ResourceExhausted | Code::DeadlineExceeded => Self::Limit,
            _ => Self::Master,
        }
    }
}
