//! What a run is watched by: told to stop, counted.

use crate::progress::Progress;
use crate::stop::Stop;

/// What long work asks and tells while it goes on.
#[derive(Clone, Copy, Debug)]
pub struct Run<'a> {
    /// Asked between steps (a source, a batch, a pass) whether to go on.
    pub stop: &'a Stop,
    /// Told how far it is.
    pub progress: &'a Progress,
}
