//! Why a solve fails.

use nestrad_kernel::BlockFault;
use thiserror::Error;

use crate::exchange::ExchangeError;
use crate::solver::SolverError;
use crate::stop::Stopped;

/// Why there is no solution.
#[derive(Debug, Error)]
pub enum SolveError {
    /// The kernel refused the canopy.
    #[error("the canopy cannot be traced")]
    Block(#[from] BlockFault),
    /// The exchange could not be computed.
    #[error(transparent)]
    Exchange(ExchangeError),
    /// The solver did not converge.
    #[error(transparent)]
    Solver(SolverError),
    /// Light is lost or gained, far beyond what the sampling leaves uncertain.
    #[error(
        "the energy balance of band {band} does not close: the closure is {:.1} % of the incoming light, its standard error {:.1} %: too few lines join faces of very different size, expected a smaller --accuracy or a scene with parts of more similar size",
        100.0 * missing,
        100.0 * stated
    )]
    Unbalanced {
        /// Name of the band.
        band: String,
        /// What is missing, in parts of the incoming light.
        missing: f64,
        /// Its standard error.
        stated: f64,
    },
    /// It is not wanted any more.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl SolveError {
    /// Whether rows that were believed are not to be believed any more.
    pub(crate) fn is_distrust(&self) -> bool {
        matches!(self, Self::Exchange(ExchangeError::Distrusted { .. }))
    }
}

impl From<ExchangeError> for SolveError {
    fn from(error: ExchangeError) -> Self {
        match error {
            ExchangeError::Stopped(stopped) => Self::Stopped(stopped),
            error => Self::Exchange(error),
        }
    }
}

impl From<SolverError> for SolveError {
    fn from(error: SolverError) -> Self {
        match error {
            SolverError::Stopped(stopped) => Self::Stopped(stopped),
            error => Self::Solver(error),
        }
    }
}
