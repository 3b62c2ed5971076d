//! The master as a service: it keeps scenes and solves, computes one solve after the other, and gives
//! out what came of them, over gRPC.
//!
//! Calls are answered on tokio's threads; what takes time is done on threads of its own and rayon's.
//! Everything that a caller chooses the size of is bounded: see [`ServiceLimits`].

mod admission;
mod budget;
mod caller;
mod compute;
mod error;
mod held;
mod identity;
mod intake;
mod limits;
mod lock;
mod metrics;
mod metrics_port;
mod residents;
mod rpc;
mod scenes;
mod serve;
mod share;
mod slices;
mod solution;
mod solve;
mod solves;
mod supervisor;
mod uploads;

pub use error::{ErrorCode, ServiceError};
pub use limits::ServiceLimits;
pub use metrics::Metrics;
pub use serve::{ServeError, Service};
pub use supervisor::Fault;
