//! A worker at the service of a master: it joins, computes jobs, and leaves.

mod blocks;
mod calls;
mod session;
mod slot;

use std::sync::Arc;
use std::time::Duration;

use nestrad_proto::channel::Authorized;
use nestrad_proto::reason;
use thiserror::Error;
use tokio::sync::watch;
use tonic::{Code, Status};

use blocks::Blocks;
use calls::Master;
use session::{End, Session};

/// What a worker says of itself, and keeps to.
#[derive(Clone, Debug)]
pub struct Offer {
    /// For people to read.
    pub name: String,
    /// Jobs that it computes at a time.
    pub threads: u32,
    /// Memory that it may take, bytes.
    pub memory_bytes: u64,
}

/// Why a worker gives up.
#[derive(Debug, Error)]
pub enum ServingError {
    /// The master does not want it, now or later.
    #[error("the master refuses this worker: {0}")]
    TurnedAway(String),
    /// There are no threads to compute with.
    #[error("cannot start threads")]
    Threads(#[from] rayon::ThreadPoolBuildError),
}

/// Waits between attempts to reach a master: from the first to the last.
const FIRST_PAUSE: Duration = Duration::from_millis(100);
const LAST_PAUSE: Duration = Duration::from_secs(5);

/// How long a worker that is told to stop goes on with its jobs, before it gives them back.
const GRACE: Duration = Duration::from_secs(8);

/// Serves the master behind a channel until that says that there is nothing more to do, or until `stop`
/// becomes true. A master that goes away is waited for.
pub async fn serve(
    channel: Authorized,
    offer: Offer,
    mut stop: watch::Receiver<bool>,
) -> Result<(), ServingError> {
    let master = Master::new(channel);
    let blocks = Arc::new(Blocks::new(&offer));
    let pools = slot::pools(offer.threads)?;
    let mut pause = FIRST_PAUSE;
    loop {
        let joined = tokio::select! {
            joined = master.join(&offer) => joined,
            _ = stop.wait_for(|stop| *stop) => return Ok(()),
        };
        match joined {
            Ok(joined) => {
                pause = FIRST_PAUSE;
                tracing::info!(worker = joined.worker_id, "joined");
                let session = Session::new(master.clone(), blocks.clone(), &joined);
                match session.run(&pools, stop.clone(), GRACE).await {
                    End::Drained | End::Stopped => return Ok(()),
                    End::Lost => tracing::warn!("the master does not know this worker any more"),
                }
            }
            Err(status) if is_final(&status) => {
                return Err(ServingError::TurnedAway(reason::of(&status)));
            }
            Err(status) => {
                tracing::warn!(
                    reason = reason::of(&status),
                    "cannot join, trying again in {pause:?}"
                );
                tokio::select! {
                    () = tokio::time::sleep(pause) => {}
                    _ = stop.wait_for(|stop| *stop) => return Ok(()),
                }
                pause = (2 * pause).min(LAST_PAUSE);
            }
        }
    }
}

/// Whether trying again is of no use.
fn is_final(status: &Status) -> bool {
    reason::of_credentials(status).is_some()
        || matches!(
            status.code(),
            Code::FailedPrecondition
                | Code::InvalidArgument
                | Code::Unauthenticated
                | Code::PermissionDenied
                | Code::Unimplemented
        )
}
