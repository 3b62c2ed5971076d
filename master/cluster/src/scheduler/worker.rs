//! What the scheduler knows of a worker.

use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Duration;

use super::{Id, Identity, Time};

/// Jobs that a worker may hold before it has returned any, and those that each result allows it besides: who only
/// says that it has many threads does not get all jobs there are.
const LEASES_AT_FIRST: u64 = 64;
const LEASES_A_RESULT: u64 = 2;

/// What a worker said of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerFacts {
    /// For people to read.
    pub name: String,
    /// By what it is known when it comes again.
    pub identity: Identity,
    /// The same for people to read: its name and address, or its certificate.
    pub who: Arc<str>,
    /// Jobs that it computes at a time.
    pub threads: u32,
    /// Memory that it may take, bytes.
    pub memory_bytes: u64,
}

/// What a worker does and did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerCounts {
    /// What it said of itself.
    pub facts: WorkerFacts,
    /// Jobs that it holds.
    pub leased: usize,
    /// Results that were good.
    pub done: u64,
    /// Jobs that it lost or failed.
    pub lost: u64,
    /// Since it was last heard of.
    pub silent: Duration,
    /// Memory that the smallest block needs of it, bytes, where it has less: it is idle for that.
    pub too_small_for: Option<u64>,
}

#[derive(Debug)]
pub(super) struct Worker {
    pub(super) facts: WorkerFacts,
    /// When it was last heard of.
    pub(super) heard: Time,
    /// Leases that are not lost.
    pub(super) leases: BTreeSet<Id>,
    /// The memory that it was told to lack, bytes.
    pub(super) told: Option<u64>,
    pub(super) counts: Done,
}

#[derive(Debug, Default)]
pub(super) struct Done {
    pub(super) done: u64,
    pub(super) lost: u64,
}

impl Worker {
    pub(super) fn new(facts: WorkerFacts, now: Time) -> Self {
        Self {
            facts,
            heard: now,
            leases: BTreeSet::new(),
            told: None,
            counts: Done::default(),
        }
    }

    /// A job at work and one on its way back, for each thread.
    pub(super) fn most_leases(&self) -> usize {
        2 * self.facts.threads as usize
    }

    /// As many as that, once it has shown that it computes.
    pub(super) fn may_lease(&self) -> bool {
        let earned =
            LEASES_AT_FIRST.saturating_add(LEASES_A_RESULT.saturating_mul(self.counts.done));
        (self.leases.len() as u64) < earned
    }

    pub(super) fn counts(&self, now: Time, too_small_for: Option<u64>) -> WorkerCounts {
        WorkerCounts {
            facts: self.facts.clone(),
            leased: self.leases.len(),
            done: self.counts.done,
            lost: self.counts.lost,
            silent: now.saturating_sub(self.heard),
            too_small_for,
        }
    }
}
