//! A thread that solves: what it has begun ends, even where the thread does not live to say how.

use std::ops::Deref;
use std::sync::Arc;

use nestrad_engine::traced::FailureKind;

use super::super::metrics::Metrics;
use super::super::solve::{Phase, Solve};
use super::Solves;

const LOST: &str = "internal fault: the thread that computed it has ended";
const NOBODY: &str = "internal fault: the threads that compute have ended";

/// One of the threads that take solves from the queue.
pub(in super::super) struct Solver<'a> {
    solves: &'a Solves,
    metrics: &'a Metrics,
}

impl<'a> Solver<'a> {
    /// To be held by the thread for as long as it takes solves.
    pub(in super::super) fn of(solves: &'a Solves, metrics: &'a Metrics) -> Self {
        solves.lock().solvers += 1;
        Self { solves, metrics }
    }

    /// The next solve to compute; waits for it. None when the master stops.
    pub(in super::super) fn next(&self) -> Option<Begun<'a>> {
        let solve = self.solves.next()?;
        Some(Begun {
            solve,
            solves: self.solves,
            metrics: self.metrics,
        })
    }
}

impl Drop for Solver<'_> {
    /// Where nobody is left to compute, who waits would wait for ever.
    fn drop(&mut self) {
        let mut known = self.solves.lock();
        known.solvers -= 1;
        if known.solvers > 0 {
            return;
        }
        known.stopping = true;
        let waits = |solve: &&Arc<Solve>| matches!(solve.phase(), Phase::Queued);
        for solve in known.solves.iter().filter(waits) {
            let phase = Phase::Failed(FailureKind::Fault, NOBODY.to_owned());
            self.metrics.ended(&phase);
            solve.end(phase);
        }
    }
}

/// A solve that is computed.
pub(in super::super) struct Begun<'a> {
    solve: Arc<Solve>,
    solves: &'a Solves,
    metrics: &'a Metrics,
}

impl Begun<'_> {
    /// Says what came of it.
    pub(in super::super) fn ends(&self, phase: Phase) {
        self.metrics.ended(&phase);
        self.solves.ended(&self.solve, phase);
    }
}

impl Deref for Begun<'_> {
    type Target = Solve;

    fn deref(&self) -> &Solve {
        &self.solve
    }
}

impl Drop for Begun<'_> {
    fn drop(&mut self) {
        if !self.solve.phase().has_ended() {
            self.ends(Phase::Failed(FailureKind::Fault, LOST.to_owned()));
        }
    }
}
