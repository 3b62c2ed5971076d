//! Telling work to stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use thiserror::Error;

/// What may be told to stop; clones are the same. A part of the work gets a stop of its own
/// ([`Stop::part`]), so that one part can be stopped and the rest go on.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<Flag>);

#[derive(Debug, Default)]
struct Flag {
    stopped: AtomicBool,
    whole: Option<Stop>,
}

/// The work is not wanted any more.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("cancelled")]
pub struct Stopped;

impl Stop {
    /// The stop of a part of this work: it stops with the whole, and the whole goes on without it.
    #[must_use]
    pub fn part(&self) -> Self {
        Self(Arc::new(Flag {
            stopped: AtomicBool::new(false),
            whole: Some(self.clone()),
        }))
    }

    /// Asks for the work to stop at its next step.
    pub fn stop(&self) {
        self.0.stopped.store(true, Ordering::Relaxed);
    }

    /// To be asked between steps: an error once [`Stop::stop`] was called, of this work or of the whole.
    pub fn check(&self) -> Result<(), Stopped> {
        if self.0.stopped.load(Ordering::Relaxed) {
            return Err(Stopped);
        }
        self.0.whole.as_ref().map_or(Ok(()), Self::check)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_stops_with_the_whole_and_not_the_other_way_round() {
        let whole = Stop::default();
        let [one, other] = [whole.part(), whole.part()];
        one.stop();
        assert_eq!(one.check(), Err(Stopped));
        assert_eq!((other.check(), whole.check()), (Ok(()), Ok(())));
        whole.clone().stop();
        assert_eq!((other.check(), whole.check()), (Err(Stopped), Err(Stopped)));
    }
}
