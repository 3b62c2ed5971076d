//! Parameters driven to their ends: small scenes whose right answer is known, or that are to be refused.
//!
//! One module per axis. [`run`] runs every case in a thread of its own, with a time limit; a panic is a
//! failed case. `cargo run --release -p nestrad-tests --bin extremes` writes the table to
//! `master/docs/extremes.md`.

mod geometry;
pub mod judge;
mod light;
mod method;
mod optics;
mod position;
pub mod table;
pub mod wild;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

/// No case may take longer.
const LIMIT: Duration = Duration::from_secs(120);

/// A scene at an end of some axis.
pub struct Case {
    /// What is driven to its end.
    pub axis: &'static str,
    /// The case in words.
    pub name: String,
    /// What is right, and where it comes from.
    pub expected: String,
    run: Box<dyn FnOnce() -> Verdict + Send>,
}

/// What happened, if it was right, or what was wrong.
pub type Verdict = Result<Seen, String>;

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// In a word.
    pub happens: &'static str,
    /// The figure that it was judged by, or the message of a refusal.
    pub figure: String,
}

impl Case {
    fn new(
        axis: &'static str,
        name: impl Into<String>,
        expected: impl Into<String>,
        run: impl FnOnce() -> Verdict + Send + 'static,
    ) -> Self {
        Self {
            axis,
            name: name.into(),
            expected: expected.into(),
            run: Box::new(run),
        }
    }
}

/// A case that has been run.
#[derive(Clone, Debug)]
pub struct Row {
    /// See [`Case`].
    pub axis: &'static str,
    /// See [`Case`].
    pub name: String,
    /// See [`Case`].
    pub expected: String,
    /// What came of it.
    pub verdict: Verdict,
    /// How long it took.
    pub took: Duration,
}

/// All cases.
pub fn cases() -> Vec<Case> {
    [
        optics::cases(),
        geometry::cases(),
        position::cases(),
        light::cases(),
        method::cases(),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Runs a case. One that does not end is left behind.
pub fn run(case: Case) -> Row {
    let Case {
        axis,
        name,
        expected,
        run,
    } = case;
    let (send, receive) = mpsc::channel();
    let begun = Instant::now();
    thread::spawn(move || {
        let verdict = catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
            let text = panic
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| panic.downcast_ref::<&str>().copied());
            Err(format!("panic: {}", text.unwrap_or("without a word")))
        });
        // nobody waits any more for a case that took too long
        let _ = send.send(verdict);
    });
    let verdict = receive
        .recv_timeout(LIMIT)
        .unwrap_or_else(|_| Err(format!("no end within {LIMIT:?}")));
    Row {
        axis,
        name,
        expected,
        verdict,
        took: begun.elapsed(),
    }
}
