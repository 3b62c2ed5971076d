//! Why there is no study.

use nestrad_common::light::sky::SkyError;
use thiserror::Error;

use super::ledger::LedgerError;
use crate::output::OutputError;
use crate::plan::PlanError;
use crate::run::RunError;

/// Why there is no study. What was measured so far is in the ledger.
#[derive(Debug, Error)]
pub enum TradeError {
    /// There is no plan for a reference, however coarse.
    #[error("no reference can be planned")]
    ReferencePlan(#[source] PlanError),
    /// The reference cannot be computed.
    #[error("the reference cannot be computed")]
    Reference(#[source] RunError),
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
    /// A plan cannot be named.
    #[error("a plan cannot be written down")]
    Plan(#[source] serde_json::Error),
}
