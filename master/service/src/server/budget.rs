//! A bound on memory that is counted as long as what it was taken for lives, and for whom.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use super::caller::Caller;
use super::lock::lock;

/// Bytes that may be taken, and that are.
#[derive(Clone, Debug)]
pub(super) struct Budget {
    limit: u64,
    used: Arc<Mutex<Used>>,
}

#[derive(Debug, Default)]
struct Used {
    all: u64,
    by: HashMap<Caller, u64>,
}

/// Bytes that are taken, given back when this goes.
#[derive(Debug)]
pub(super) struct Reservation {
    caller: Caller,
    bytes: u64,
    used: Arc<Mutex<Used>>,
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
        lock(&self.used).all
    }

    /// What a client has of it.
    pub(super) fn used_by(&self, caller: Caller) -> u64 {
        lock(&self.used).by.get(&caller).copied().unwrap_or(0)
    }

    /// Takes bytes for a client, if there are so many left.
    pub(super) fn take(&self, caller: Caller, bytes: u64) -> Option<Reservation> {
        let mut used = lock(&self.used);
        let all = used.all.checked_add(bytes)?;
        if all > self.limit {
            return None;
        }
        used.all = all;
        *used.by.entry(caller).or_default() += bytes;
        Some(Reservation {
            caller,
            bytes,
            used: self.used.clone(),
        })
    }
}

impl Reservation {
    pub(super) fn caller(&self) -> Caller {
        self.caller
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Both in one, which are of one client.
    pub(super) fn join(&mut self, mut other: Self) {
        self.bytes += std::mem::take(&mut other.bytes);
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        let mut used = lock(&self.used);
        used.all -= self.bytes;
        if let Some(own) = used.by.get_mut(&self.caller) {
            *own -= self.bytes;
            if *own == 0 {
                used.by.remove(&self.caller);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_is_given_back() {
        let budget = Budget::new(10);
        let [one, two] = [1, 2].map(Caller::number);
        let mut first = budget.take(one, 6).unwrap();
        assert!(budget.take(one, 5).is_none() && budget.take(two, u64::MAX).is_none());
        first.join(budget.take(one, 3).unwrap());
        let second = budget.take(two, 1).unwrap();
        assert_eq!((budget.used(), budget.used_by(one)), (10, 9));
        drop(first);
        assert_eq!((budget.used(), budget.used_by(one)), (1, 0));
        assert_eq!(budget.used_by(two), 1);
        drop(second);
        assert_eq!(budget.used(), 0);
    }
}
