//! Counting how far work is, for whoever asks. Nothing is shown here.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// How far the work is; shared by reference between threads.
#[derive(Debug, Default)]
pub struct Progress {
    stage: Mutex<Option<RunningStage>>,
}

/// How far the running stage is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StageProgress {
    /// Its name; empty between stages.
    pub name: String,
    /// Steps that are done.
    pub done: u64,
    /// Steps that it has; 0 where they are not counted.
    pub total: u64,
}

#[derive(Debug)]
struct RunningStage {
    progress: StageProgress,
    begun: Instant,
}

impl Progress {
    /// Begins a stage of so many steps; 0 where they are not counted.
    pub fn stage(&self, name: &str, total: u64) {
        *self.lock() = Some(RunningStage {
            progress: StageProgress {
                name: name.to_owned(),
                done: 0,
                total,
            },
            begun: Instant::now(),
        });
    }

    /// Counts steps of the running stage.
    pub fn inc(&self, steps: u64) {
        if let Some(stage) = &mut *self.lock() {
            stage.progress.done = stage.progress.done.saturating_add(steps);
        }
    }

    /// Ends the running stage.
    pub fn finish(&self) {
        *self.lock() = None;
    }

    /// How far the running stage is.
    pub fn now(&self) -> StageProgress {
        let stage = self.lock();
        let now = stage.as_ref().map(|stage| StageProgress {
            done: stage.progress.done.min(stage.progress.total),
            ..stage.progress.clone()
        });
        now.unwrap_or_default()
    }

    /// When the running stage began; `None` between stages.
    pub fn begun(&self) -> Option<Instant> {
        self.lock().as_ref().map(|stage| stage.begun)
    }

    fn lock(&self) -> MutexGuard<'_, Option<RunningStage>> {
        // counts are whole at any time, even if a thread died with the lock
        self.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_all_threads_are_counted() {
        let progress = Progress::default();
        progress.inc(1);
        assert_eq!(progress.now(), StageProgress::default());
        progress.stage("exchange", 4_000);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..1_000).for_each(|_| progress.inc(1)));
            }
        });
        progress.inc(5);
        let now = progress.now();
        assert_eq!(
            (now.name.as_str(), now.done, now.total),
            ("exchange", 4_000, 4_000)
        );
        progress.finish();
        assert!(progress.begun().is_none());
    }
}
