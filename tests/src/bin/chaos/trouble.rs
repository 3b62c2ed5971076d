//! What was wrong when: an error that a client ends with has to have its cause here.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use crate::process::lock;

/// What may be the cause of an error of a client. Full disks, logs that nobody reads, and other workers and
/// clients, whatever they do, are none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    MasterKilled,
    MasterTerminated,
    MasterPaused,
    /// The way of one client.
    Way(usize),
}

struct Trouble {
    kind: Kind,
    /// `None` while it lasts.
    ended: Option<Instant>,
}

/// All of a run.
#[derive(Default)]
pub(crate) struct Troubles(Mutex<Vec<Trouble>>);

/// What a trouble leaves behind goes on for so long: connections that are given up, queues that run empty.
const AFTER: Duration = Duration::from_secs(60);

/// A program that goes on takes so long to do what has piled up.
const MOMENT: Duration = Duration::from_secs(5);

/// Lasts until this is dropped.
pub(crate) struct Lasting<'a>(&'a Troubles, usize);

impl Troubles {
    pub(crate) fn begin(&self, kind: Kind) -> Lasting<'_> {
        let mut all = lock(&self.0);
        all.push(Trouble { kind, ended: None });
        Lasting(self, all.len() - 1)
    }

    /// Whether there was any of a kind since then, or up to a minute before.
    pub(crate) fn within(&self, kind: Kind, since: Instant) -> bool {
        self.is_near(kind, since, AFTER)
    }

    /// Whether there was any of a kind since then, or a moment before.
    pub(crate) fn just_now(&self, kind: Kind, since: Instant) -> bool {
        self.is_near(kind, since, MOMENT)
    }

    fn is_near(&self, kind: Kind, since: Instant, after: Duration) -> bool {
        let all = lock(&self.0);
        all.iter()
            .filter(|trouble| trouble.kind == kind)
            .any(|trouble| trouble.ended.is_none_or(|ended| ended + after > since))
    }
}

impl Drop for Lasting<'_> {
    fn drop(&mut self) {
        lock(&self.0.0)[self.1].ended = Some(Instant::now());
    }
}
