//! Progress of long work: on the terminal, or for whoever asks; and a way to stop the work.

use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use thiserror::Error;

/// Work that is done sooner than this shows no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// A bar for the running stage, drawn on stderr once the stage has taken more than a second. Shared
/// by reference between threads; it disappears with the stage.
#[derive(Debug)]
pub struct Progress {
    visible: bool,
    stage: Mutex<Option<RunningStage>>,
    cancelled: AtomicBool,
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

/// Somebody wants the work no more.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("cancelled")]
pub struct Cancelled;

#[derive(Debug)]
struct RunningStage {
    name: String,
    total: u64,
    done: u64,
    begun: Instant,
    bar: Option<ProgressBar>,
}

impl Progress {
    /// Silent if `quiet`, or where stderr is not a terminal.
    pub fn new(quiet: bool) -> Self {
        Self {
            visible: !quiet && std::io::stderr().is_terminal(),
            stage: Mutex::new(None),
            cancelled: AtomicBool::new(false),
        }
    }

    /// Asks for the work to stop at its next step.
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// To be asked between steps: an error once [`Progress::cancel`] was called.
    pub fn check(&self) -> Result<(), Cancelled> {
        let cancelled = self.cancelled.load(Ordering::Relaxed);
        if cancelled { Err(Cancelled) } else { Ok(()) }
    }

    /// How far the running stage is.
    pub fn now(&self) -> StageProgress {
        let stage = self.lock();
        let stage = stage.as_ref().map(|stage| StageProgress {
            name: stage.name.clone(),
            done: stage.done.min(stage.total),
            total: stage.total,
        });
        stage.unwrap_or_default()
    }

    /// Ends the running stage and begins one that consists of `total` steps, 0 where they are not
    /// counted.
    pub fn stage(&self, name: &str, total: u64) {
        self.replace(Some(RunningStage {
            name: name.to_owned(),
            total,
            done: 0,
            begun: Instant::now(),
            bar: None,
        }));
    }

    /// `steps` more steps of the running stage are done. It takes a lock: call it for milliseconds
    /// of work, not for every ray.
    pub fn inc(&self, steps: u64) {
        if let Some(stage) = &mut *self.lock() {
            stage.advance(steps, self.visible);
        }
    }

    /// Ends the running stage.
    pub fn finish(&self) {
        self.replace(None);
    }

    fn replace(&self, next: Option<RunningStage>) {
        let last = std::mem::replace(&mut *self.lock(), next);
        if let Some(bar) = last.and_then(|stage| stage.bar) {
            bar.finish_and_clear();
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<RunningStage>> {
        // counts are whole at any time, even if a thread died with the lock
        self.stage.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

impl RunningStage {
    fn advance(&mut self, steps: u64, visible: bool) {
        self.done = self.done.saturating_add(steps);
        if visible && self.bar.is_none() && self.begun.elapsed() >= PATIENCE {
            self.bar = Some(self.new_bar());
        }
        if let Some(bar) = &self.bar {
            bar.set_position(self.done.min(self.total));
        }
    }

    fn new_bar(&self) -> ProgressBar {
        let style = ProgressStyle::with_template("{msg:20} {bar:40} {percent:>3} %  {eta} left")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        ProgressBar::with_draw_target(Some(self.total), ProgressDrawTarget::stderr())
            .with_style(style)
            .with_message(self.name.clone())
            .with_elapsed(self.begun.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn visible() -> Progress {
        let mut progress = Progress::new(true);
        progress.visible = true;
        progress
    }

    #[test]
    fn steps_of_all_threads_are_counted() {
        let progress = visible();
        progress.inc(1);
        progress.stage("exchange", 4_000);
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| (0..1_000).for_each(|_| progress.inc(1)));
            }
        });
        let done = progress
            .lock()
            .as_ref()
            .map(|stage| (stage.done, stage.bar.is_none()));
        assert_eq!(done, Some((4_000, true)));
        progress.finish();
        assert!(progress.lock().is_none());
    }

    #[test]
    fn a_long_stage_gets_a_bar_that_goes_with_it() {
        let progress = visible();
        progress.stage("exchange", 10);
        if let Some(stage) = &mut *progress.lock() {
            stage.begun -= PATIENCE;
        }
        progress.inc(12);
        let bar = progress
            .lock()
            .as_ref()
            .and_then(|stage| stage.bar.clone())
            .expect("a bar");
        assert_eq!((bar.position(), bar.length()), (10, Some(10)));
        progress.stage("solve", 1);
        assert!(bar.is_finished());
    }

    #[test]
    fn quiet_is_silent_but_answers() {
        let progress = Progress::new(true);
        assert_eq!(progress.now(), StageProgress::default());
        progress.stage("exchange", 2);
        if let Some(stage) = &mut *progress.lock() {
            stage.begun -= PATIENCE;
        }
        progress.inc(1);
        let now = progress.now();
        assert_eq!((now.name.as_str(), now.done, now.total), ("exchange", 1, 2));
        assert!(
            progress
                .lock()
                .as_ref()
                .is_some_and(|stage| stage.bar.is_none())
        );
    }

    #[test]
    fn work_that_is_not_wanted_is_told() {
        let progress = Progress::new(true);
        assert_eq!(progress.check(), Ok(()));
        progress.cancel();
        assert_eq!(progress.check(), Err(Cancelled));
    }
}
