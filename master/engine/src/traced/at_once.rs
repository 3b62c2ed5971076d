//! Two things at the same time, of which a failure stops both.

use std::panic::resume_unwind;
use std::thread;

use crate::progress::Progress;
use crate::run::Run;
use crate::solve_error::SolveError;

/// Does one thing here and another on a thread of its own, which is not counted. Where one fails, the other is
/// stopped, and the failure keeps its cause.
pub(super) fn at_once<A, B: Send>(
    run: &Run,
    here: impl FnOnce(&Run) -> Result<A, SolveError>,
    there: impl FnOnce(&Run) -> Result<B, SolveError> + Send,
) -> Result<(A, B), SolveError> {
    let stop = run.stop.part();
    let uncounted = Progress::default();
    let (here, there) = thread::scope(|scope| {
        let there = scope.spawn(|| {
            let run = Run {
                stop: &stop,
                ..*run
            };
            there(&run).inspect_err(|_| stop.stop())
        });
        let run = Run {
            stop: &stop,
            progress: &uncounted,
        };
        let here = here(&run).inspect_err(|_| stop.stop());
        (
            here,
            there.join().unwrap_or_else(|panic| resume_unwind(panic)),
        )
    });
    match (here, there) {
        (Ok(here), Ok(there)) => Ok((here, there)),
        (Err(SolveError::Stopped(_)), Err(error)) | (Err(error), _) | (_, Err(error)) => Err(error),
    }
}
