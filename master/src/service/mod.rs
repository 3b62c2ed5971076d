//! The master as a service: it keeps scenes and solves, computes one solve after the other, and gives
//! out what came of them, over gRPC.
//!
//! Calls are answered on tokio's threads; what takes time is done on threads of its own and rayon's.
//! Everything that a caller chooses the size of is bounded: see [`Limits`].

mod budget;
mod compute;
mod connection;
mod error;
mod identity;
mod intake;
mod metrics;
mod outcome;
mod rpc;
mod scenes;
mod server;
mod slices;
mod solves;

pub use error::{ErrorCode, ServiceError};
pub use metrics::Metrics;
pub use server::{ServeError, Service, serve_metrics};

/// What a master takes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Memory of the scenes that are held, bytes.
    pub scene_bytes: u64,
    /// Memory of the results that are held, bytes.
    pub result_bytes: u64,
    /// Memory of one solve, GiB.
    pub solve_GiB: f64,
    /// Solves that are computed at a time; at least 1.
    pub solves: usize,
    /// Solves that may wait.
    pub queue: usize,
    /// Time for running solves to end when the master is told to stop, seconds.
    pub drain_s: u64,
}
