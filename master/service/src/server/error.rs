//! What goes wrong in the service, and how it is said in gRPC.

use std::fmt::Display;

use thiserror::Error;
use tonic::{Code, Status};

/// What kind of thing went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorCode {
    /// The caller sent what cannot be.
    Invalid,
    /// The master does not have it, or no longer.
    NotFound,
    /// A limit of the master is met.
    Exhausted,
    /// What was asked for cannot be had in this state.
    NotReady,
    /// The caller was silent for too long.
    TooLate,
    /// The master is about to stop.
    Stopping,
    /// A fault of the master.
    Internal,
}

impl ErrorCode {
    fn grpc(self) -> Code {
        match self {
            Self::Invalid => Code::InvalidArgument,
            Self::NotFound => Code::NotFound,
            Self::Exhausted => Code::ResourceExhausted,
            Self::NotReady => Code::FailedPrecondition,
            Self::TooLate => Code::DeadlineExceeded,
            Self::Stopping => Code::Unavailable,
            Self::Internal => Code::Internal,
        }
    }
}

/// Why a call failed.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{message}")]
pub struct ServiceError {
    /// The kind.
    pub code: ErrorCode,
    /// What was found where, and what was expected.
    pub message: String,
}

impl ServiceError {
    /// An error of this kind.
    pub fn new(code: ErrorCode, message: impl Display) -> Self {
        let message = message.to_string();
        Self { code, message }
    }

    /// Something at `place` in what the caller sent is not what was expected there.
    pub(super) fn invalid(
        place: impl Display,
        expected: impl Display,
        found: impl Display,
    ) -> Self {
        let message = format!("{place}: expected {expected}, found {found}");
        Self::new(ErrorCode::Invalid, message)
    }
}

impl From<ServiceError> for Status {
    fn from(error: ServiceError) -> Self {
        Self::new(error.code.grpc(), error.message)
    }
}
