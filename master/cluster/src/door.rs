//! The door of a cluster that one solve has to itself: where workers come in.

use std::io;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use nestrad_common::panics::Panic;
use nestrad_engine::causes::causes;
use nestrad_proto::access::{Access, AccessError};
use nestrad_proto::connections::{ConnectionLimits, Connections};
use rayon::ThreadPoolBuildError;
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::oneshot;

use crate::cluster::{Cluster, WorkerLimits};
use crate::service::worker_service;

/// How long workers may take to leave at the end.
const FAREWELL: Duration = Duration::from_secs(5);

/// How often it is looked whether they have.
const PAUSE: Duration = Duration::from_millis(20);

/// An open door. Closing it sends the workers home.
pub struct Door {
    cluster: Cluster,
    address: SocketAddr,
    runtime: Option<Runtime>,
    close: Option<oneshot::Sender<()>>,
}

/// Why a door cannot be opened.
#[derive(Debug, Error)]
pub enum DoorError {
    /// The address is taken, or not this machine's.
    #[error("cannot listen at {address}")]
    Listen {
        /// Where it was to listen.
        address: SocketAddr,
        /// What the system says.
        source: io::Error,
    },
    /// Not without credentials.
    #[error(transparent)]
    Access(#[from] AccessError),
    /// There are no threads for it.
    #[error("cannot start threads")]
    Runtime(#[source] io::Error),
    /// There are no threads to check results with.
    #[error("cannot start threads")]
    Threads(#[from] ThreadPoolBuildError),
}

impl Door {
    /// Opens a door at an address, where port 0 stands for any that is free. Results are checked on so
    /// many threads.
    pub fn open(
        address: SocketAddr,
        access: &Access,
        limits: WorkerLimits,
        threads: usize,
    ) -> Result<Self, DoorError> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .map_err(DoorError::Runtime)?;
        let listen = |source| DoorError::Listen { address, source };
        let entered = runtime.enter();
        let listener = runtime
            .block_on(TcpListener::bind(address))
            .map_err(listen)?;
        let at = listener.local_addr().map_err(listen)?;
        let connections = Connections::new(ConnectionLimits::default().within_open_files());
        let mut server = access.server(at, &connections)?;
        let cluster = Cluster::new(limits, threads)?;
        let (close, closed) = oneshot::channel();
        let watching = cluster.keep_watch();
        let serving = server
            .add_service(worker_service(cluster.clone()))
            .serve_with_incoming_shutdown(connections.incoming(listener), async {
                // the sender that is gone closes, too
                let _ = closed.await;
            });
        // without either, workers cannot be waited for
        let both = async move {
            tokio::select! {
                served = serving => served.map_err(|error| causes(&error)),
                () = watching => Ok(()),
            }
        };
        let (guarded, failing) = (runtime.spawn(both), cluster.clone());
        runtime.spawn(async move {
            match guarded.await {
                Ok(Ok(())) => {}
                Ok(Err(reason)) => {
                    failing.desert(&format!("the service for workers failed: {reason}"))
                }
                Err(error) if error.is_panic() => {
                    let panic = Panic::of(&*error.into_panic());
                    failing.desert(&format!("internal fault: {panic}"));
                }
                // the door is closed
                Err(_) => {}
            }
        });
        drop(entered);
        Ok(Self {
            cluster,
            address: at,
            runtime: Some(runtime),
            close: Some(close),
        })
    }

    /// The workers behind it.
    pub fn cluster(&self) -> &Cluster {
        &self.cluster
    }

    /// Where it is.
    pub fn address(&self) -> SocketAddr {
        self.address
    }
}

impl Drop for Door {
    fn drop(&mut self) {
        self.cluster.drain();
        let begun = Instant::now();
        while self.cluster.has_workers() && begun.elapsed() < FAREWELL {
            std::thread::sleep(PAUSE);
        }
        drop(self.close.take());
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_timeout(PAUSE);
        }
    }
}
