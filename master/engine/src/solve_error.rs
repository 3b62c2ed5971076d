//! Why a solve fails.

use std::any::Any;

use nestrad_kernel::BlockFault;
use thiserror::Error;

use crate::exchange::ExchangeError;
use crate::plan::PlanError;
use crate::solver::SolverError;
use crate::stop::Stopped;

/// What kind of thing keeps a solve from its results: callers act by it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FailureKind {
    /// The scene or an option cannot be.
    Input,
    /// A limit that was set does not allow it.
    Limit,
    /// It was computed, and went wrong.
    Fault,
    /// It is not wanted any more.
    Cancelled,
}

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
    /// The program panicked.
    #[error("internal fault: {0}")]
    Panic(String),
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

impl SolveError {
    /// What a panic said, as an error.
    pub(crate) fn of_panic(panic: &(dyn Any + Send)) -> Self {
        let text = panic.downcast_ref::<&str>().copied();
        let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
        Self::Panic(text.unwrap_or("the program panicked").to_owned())
    }

    /// Its kind.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Stopped(_) => FailureKind::Cancelled,
            Self::Exchange(ExchangeError::BlockTooLarge { .. }) => FailureKind::Limit,
            Self::Block(_)
            | Self::Exchange(_)
            | Self::Solver(_)
            | Self::Unbalanced { .. }
            | Self::Panic(_) => FailureKind::Fault,
        }
    }
}

impl PlanError {
    /// Its kind.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Memory { .. }
            | Self::Elements { .. }
            | Self::Time { .. }
            | Self::Overtime { .. } => FailureKind::Limit,
            Self::Accuracy { .. }
            | Self::Overhang { .. }
            | Self::Narrow { .. }
            | Self::Height { .. } => FailureKind::Input,
        }
    }
}
