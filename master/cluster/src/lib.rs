//! Workers on other machines, or in other processes: they join, lease jobs, and return rows.
//!
//! The scheduler decides, without clock or network; the service speaks with workers on tokio's threads;
//! rows are checked and joined on threads of their own.
//!
//! This crate may import the engine, the kernel and the protocol; it knows no clients and no command line.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: memory_GiB"
)]

mod audits;
mod blocks;
mod cluster;
pub mod door;
pub mod kept;
pub mod local;
mod patience;
mod receive;
mod room;
mod rows;
pub mod scheduler;
mod seen;
mod sending;
mod service;
mod solving;
pub mod store;

pub use cluster::{Cluster, ClusterStatus, WorkerLimits};
pub use rows::with_rows;
pub use service::worker_service;
