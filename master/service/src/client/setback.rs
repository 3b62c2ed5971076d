//! Why a try to solve at a master came to nothing, and what to do then.

use std::time::Duration;

use nestrad_proto::RETRY_AFTER;
use tonic::Status;

use super::RemoteError;

/// Why a try came to nothing.
pub(super) enum Setback {
    /// The master is away: try again.
    Away(Status),
    /// The master does not know what it was asked for: tell it again.
    Forgotten(Status),
    /// The master has no room: ask again after a while.
    Busy {
        doing: &'static str,
        status: Status,
        wait: Duration,
    },
    /// Trying again is of no use.
    Final(RemoteError),
}

impl From<RemoteError> for Setback {
    fn from(error: RemoteError) -> Self {
        Self::Final(error)
    }
}

/// When a master that has no room wants to be asked again, if it says so.
pub(super) fn retry_after(status: &Status) -> Option<Duration> {
    let seconds = status.metadata().get(RETRY_AFTER)?.to_str().ok()?;
    seconds.parse().ok().map(Duration::from_secs)
}
