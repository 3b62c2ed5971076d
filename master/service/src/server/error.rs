//! What goes wrong in the service, and how it is said in gRPC.

use std::fmt::Display;
use std::time::Duration;

use nestrad_proto::RETRY_AFTER;
use thiserror::Error;
use tonic::metadata::MetadataMap;
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
    /// When the same call may succeed, if it may at all.
    pub again_after: Option<Duration>,
}

impl ServiceError {
    /// An error of this kind.
    pub fn new(code: ErrorCode, message: impl Display) -> Self {
        Self {
            code,
            message: message.to_string(),
            again_after: None,
        }
    }

    /// The same for what may succeed after a while; says so.
    #[must_use]
    pub fn again_after(mut self, wait: Duration) -> Self {
        let seconds = wait.as_secs_f64().ceil();
        self.message = format!("{}; try again in {seconds} s", self.message);
        self.again_after = Some(wait);
        self
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
        let mut metadata = MetadataMap::new();
        if let Some(wait) = error.again_after {
            let seconds = wait.as_secs_f64().ceil() as u64;
            metadata.insert(RETRY_AFTER, seconds.into());
        }
        Self::with_metadata(error.code.grpc(), error.message, metadata)
    }
}
