//! A progress bar on stderr: it shows what is counted, and has no part in the work.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use nestrad_common::printable;
use nestrad_engine::progress::{Progress, StageProgress};

/// A stage that is done sooner than this gets no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// Between two looks at the counts.
const PAUSE: Duration = Duration::from_millis(100);

/// Shows the running stage once it has taken more than a second, until this is dropped.
pub(crate) struct Bar {
    end: Option<Sender<()>>,
    drawing: Option<JoinHandle<()>>,
}

impl Bar {
    /// Of some counts; nothing is shown if `quiet`, or where stderr is not a terminal.
    pub(crate) fn of(progress: &Arc<Progress>, quiet: bool) -> Self {
        if quiet || !std::io::stderr().is_terminal() {
            return Self {
                end: None,
                drawing: None,
            };
        }
        let progress = progress.clone();
        let (end, ended) = mpsc::channel();
        let drawing = thread::Builder::new().spawn(move || {
            let mut shown = None;
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(PAUSE) {
                shown = redrawn(shown, &progress);
            }
            clear(shown);
        });
        Self {
            end: Some(end),
            // without a thread there is no bar
            drawing: drawing.ok(),
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(drawing) = self.drawing.take() {
            // a panic there has been shown
            let _ = drawing.join();
        }
    }
}

/// The bar of a stage.
struct Shown {
    name: String,
    bar: ProgressBar,
}

/// The bar of the running stage, if it is to have one; that of another stage disappears.
fn redrawn(shown: Option<Shown>, progress: &Progress) -> Option<Shown> {
    let waited = progress.begun().map(|begun| begun.elapsed());
    let now = progress.now();
    let Some(waited) = waited.filter(|&waited| waited >= PATIENCE) else {
        clear(shown);
        return None;
    };
    let same = shown.filter(|shown| {
        let same = shown.name == now.name && shown.bar.length() == Some(now.total);
        if !same {
            shown.bar.finish_and_clear();
        }
        same
    });
    let shown = same.unwrap_or_else(|| Shown {
        bar: new_bar(&now, waited),
        name: now.name.clone(),
    });
    shown.bar.set_position(now.done);
    Some(shown)
}

fn clear(shown: Option<Shown>) {
    if let Some(shown) = shown {
        shown.bar.finish_and_clear();
    }
}

fn new_bar(stage: &StageProgress, waited: Duration) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:20} {bar:40} {percent:>3} %  {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::with_draw_target(Some(stage.total), ProgressDrawTarget::stderr())
        .with_style(style)
        .with_message(printable::line(&stage.name).into_owned())
        .with_elapsed(waited)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_stage_gets_a_bar_that_goes_with_it() {
        let progress = Progress::default();
        progress.stage("exchange", 10);
        assert!(redrawn(None, &progress).is_none());
        thread::sleep(PATIENCE);
        progress.inc(12);
        let shown = redrawn(None, &progress);
        let bar = shown.as_ref().map(|shown| shown.bar.clone()).unwrap();
        assert_eq!((bar.position(), bar.length()), (10, Some(10)));
        progress.stage("solve", 1);
        assert!(redrawn(shown, &progress).is_none());
        assert!(bar.is_finished());
    }
}
