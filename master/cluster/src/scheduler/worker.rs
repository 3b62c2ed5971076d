//! What the scheduler knows of a worker.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Duration;

use super::{Id, Time};

/// What a worker said of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkerFacts {
    /// For people to read.
    pub name: String,
    /// Who it is, as far as the master can tell; for people to read too.
    pub identity: Arc<str>,
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
}

#[derive(Debug)]
pub(super) struct Worker {
    pub(super) facts: WorkerFacts,
    /// When it was last heard of.
    pub(super) heard: Time,
    /// Leases that are not lost.
    pub(super) leases: BTreeSet<Id>,
    /// How often it failed a job of a solve.
    pub(super) failures: BTreeMap<(Id, usize), u32>,
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
            failures: BTreeMap::new(),
            counts: Done::default(),
        }
    }

    /// A job at work and one on its way back, for each thread.
    pub(super) fn most_leases(&self) -> usize {
        2 * self.facts.threads as usize
    }

    pub(super) fn counts(&self, now: Time) -> WorkerCounts {
        WorkerCounts {
            facts: self.facts.clone(),
            leased: self.leases.len(),
            done: self.counts.done,
            lost: self.counts.lost,
            silent: now.saturating_sub(self.heard),
        }
    }
}
