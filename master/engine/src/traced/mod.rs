//! A canopy that was traced: it knows no light, and is lit again and again.
//!
//! What depends on the geometry alone (elements, rows of the exchange, lines of the far field) is computed once and
//! shared; what depends on light and optics (direct light, the solution, its account of errors) is computed by
//! [`TracedCanopy::lit`].

mod at_once;
mod canopy;
mod lit;
mod scattering;

pub(crate) use canopy::STAGE_EXCHANGE;
pub use canopy::TracedCanopy;
pub(crate) use lit::{STAGE_DIRECT_LIGHT, solve_and_keep};
pub use lit::{WorkDone, solve};

pub use crate::solve_error::{FailureKind, SolveError};
