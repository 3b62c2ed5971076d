//! How far a series is, and how long it still takes.

use std::time::{Duration, Instant};

/// Between two lines that say how far it is.
const PAUSE: Duration = Duration::from_secs(5);

/// How far the moments are.
pub(super) struct Pace {
    begun: Instant,
    last: Instant,
    done: usize,
    all: usize,
}

impl Pace {
    pub(super) fn new(all: usize) -> Self {
        let now = Instant::now();
        Self {
            begun: now,
            last: now,
            done: 0,
            all,
        }
    }

    /// What is to be said now that another moment is done.
    pub(super) fn one_more(&mut self) -> Option<String> {
        self.done += 1;
        if self.last.elapsed() < PAUSE && self.done < self.all {
            return None;
        }
        self.last = Instant::now();
        let each_s = self.begun.elapsed().as_secs_f64() / self.done as f64;
        let left_s = each_s * (self.all - self.done) as f64;
        Some(format!(
            "{} of {} moments, about {left_s:.0} s left",
            self.done, self.all
        ))
    }
}
