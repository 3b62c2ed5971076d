//! The worker: it joins a master, leases near-field jobs, runs the kernel and returns the rows.
//!
//! This crate may import the kernel and the protocol, and nothing of the master.

pub mod serving;
