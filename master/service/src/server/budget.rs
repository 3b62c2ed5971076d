//! A bound on memory that is counted as long as what it was taken for lives.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes that may be taken, and that are.
#[derive(Clone, Debug)]
pub(super) struct Budget {
    limit: u64,
    used: Arc<AtomicU64>,
}

/// Bytes that are taken, given back when this goes.
#[derive(Debug)]
pub(super) struct Reservation {
    bytes: u64,
    used: Arc<AtomicU64>,
}

impl Budget {
    pub(super) fn new(limit: u64) -> Self {
        Self {
            limit,
            used: Arc::default(),
        }
    }

    pub(super) fn limit(&self) -> u64 {
        self.limit
    }

    pub(super) fn used(&self) -> u64 {
        self.used.load(Ordering::Relaxed)
    }

    /// Takes bytes, if there are so many left.
    pub(super) fn take(&self, bytes: u64) -> Option<Reservation> {
        let more = |used: u64| used.checked_add(bytes).filter(|&sum| sum <= self.limit);
        let taken = self
            .used
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, more);
        taken.ok().map(|_| Reservation {
            bytes,
            used: self.used.clone(),
        })
    }
}

impl Reservation {
    /// Both in one.
    pub(super) fn join(&mut self, mut other: Self) {
        self.bytes += std::mem::take(&mut other.bytes);
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_is_given_back() {
        let budget = Budget::new(10);
        let mut first = budget.take(6).unwrap();
        assert!(budget.take(5).is_none() && budget.take(u64::MAX).is_none());
        first.join(budget.take(4).unwrap());
        assert_eq!(budget.used(), 10);
        drop(first);
        assert_eq!(budget.used(), 0);
    }
}
