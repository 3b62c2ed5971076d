//! Why there is no study.

use nestrad_engine::rounds::RoundsError;
use nestrad_engine::stop::Stopped;
use nestrad_engine::traced::SolveError;
use thiserror::Error;

use super::ledger::LedgerError;
use crate::error::OutputError;

/// Why there is no study. What was measured so far is in the ledger.
#[derive(Debug, Error)]
pub enum TradeError {
    /// The reference cannot be computed.
    #[error("the reference cannot be computed")]
    Reference(#[source] RoundsError),
    /// Nothing is absorbed, so there is no error to measure.
    #[error("plants absorb nothing in any band: there is no error to measure")]
    Dark,
    /// It is not wanted any more.
    #[error("the study was cancelled")]
    Stopped(#[source] Stopped),
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

impl TradeError {
    /// Why a run of the reference failed.
    pub(super) fn of_reference(error: RoundsError) -> Self {
        match error {
            RoundsError::Solve(SolveError::Stopped(stopped)) => Self::Stopped(stopped),
            error => Self::Reference(error),
        }
    }
}
