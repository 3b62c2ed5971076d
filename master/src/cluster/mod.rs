//! Workers on other machines, or in other processes: who computes which job of the exchange.

pub mod scheduler;
