//! A master without workers goes on by itself: a solve that nobody works at would never end.

use std::time::{Duration, Instant};

/// How long nobody has been there.
#[derive(Default)]
pub(crate) struct Alone {
    since: Option<Instant>,
}

impl Alone {
    /// Whether patience has come to its end. Asked for again and again.
    pub(crate) fn for_too_long(&mut self, anybody: bool, patience: Duration) -> bool {
        if anybody {
            self.since = None;
            return false;
        }
        self.since.get_or_insert_with(Instant::now).elapsed() >= patience
    }
}
