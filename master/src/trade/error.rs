//! Why there is no study.

use nestrad_common::light::sky::SkyError;
use thiserror::Error;

use super::ledger::LedgerError;
use crate::output::OutputError;
use crate::rounds::RoundsError;

/// Why there is no study. What was measured so far is in the ledger.
#[derive(Debug, Error)]
pub enum TradeError {
    /// The reference cannot be computed.
    #[error("the reference cannot be computed")]
    Reference(#[source] RoundsError),
    /// The sky cannot be.
    #[error(transparent)]
    Sky(#[from] SkyError),
    /// Nothing is absorbed, so there is no error to measure.
    #[error("plants absorb nothing in any band: there is no error to measure")]
    Dark,
    /// It is not wanted any more.
    #[error("the study was cancelled")]
    Cancelled,
    /// What was measured cannot be kept.
    #[error(transparent)]
    Ledger(#[from] LedgerError),
    /// The results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A run cannot be named.
    #[error("a run cannot be named")]
    Name(#[source] serde_json::Error),
}
