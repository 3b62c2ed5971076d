//! Whether workers compute what they say: which of their jobs the master computes again, and what it found.
//!
//! Rows that are wrong may be valid. What cannot be seen in them is seen where they are computed again: a share of
//! the jobs, and of every worker one job of a solve at least. Which ones, nobody can foretell who does not know the
//! key, and it has no influence on the results.

use std::collections::{BTreeMap, BTreeSet};
use std::hash::{BuildHasher, RandomState};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use nestrad_engine::exchange::{JobRows, Origin};
use nestrad_kernel::rows::Counts;

/// After so many workers that returned wrong rows in one solve, the master computes it by itself.
const MOST_FAILED: u32 = 3;

/// What a worker said of a job.
#[derive(Clone, Debug)]
pub(crate) struct Said {
    pub(crate) worker: Arc<str>,
    /// BLAKE3 of the packed rows.
    pub(crate) checksum: [u8; 32],
    pub(crate) counts: Counts,
}

/// The audits of one solve.
pub(crate) struct Audits {
    share: f64,
    key: RandomState,
    ledger: Mutex<Ledger>,
}

#[derive(Default)]
struct Ledger {
    /// Rounds of the solve so far.
    round: u64,
    /// By job of this round, and whether it was audited.
    said: BTreeMap<usize, (Said, bool)>,
    /// All who brought something.
    workers: BTreeSet<Arc<str>>,
    /// Workers of whom a job was computed again.
    audited: BTreeSet<Arc<str>>,
    failed: u32,
}

impl Ledger {
    /// A worker was wrong: all is done anew.
    fn failed(&mut self) {
        self.failed += 1;
        self.workers.clear();
        self.audited.clear();
    }
}

impl Audits {
    /// Of that share of all jobs; of none at all where it is 0.
    pub(crate) fn new(share: f64) -> Self {
        Self {
            share,
            key: RandomState::new(),
            ledger: Mutex::default(),
        }
    }

    /// Another round begins.
    pub(crate) fn begin(&self) {
        let mut ledger = self.lock();
        ledger.round += 1;
        ledger.said.clear();
    }

    /// Whether too many were wrong to go on with anybody.
    pub(crate) fn have_failed(&self) -> bool {
        self.lock().failed >= MOST_FAILED
    }

    /// A worker was wrong.
    pub(crate) fn failed(&self) {
        self.lock().failed();
    }

    /// One of those who brought something, if it is among these.
    pub(crate) fn any_of(&self, refused: &[Arc<str>]) -> Option<Arc<str>> {
        let ledger = self.lock();
        let mut refused = refused.iter();
        refused
            .find(|&worker| ledger.workers.contains(worker))
            .cloned()
    }

    /// A worker brought a job.
    pub(crate) fn brought(&self, job: usize, said: Said) {
        let mut ledger = self.lock();
        ledger.workers.insert(said.worker.clone());
        ledger.said.insert(job, (said, false));
    }

    /// Whether a job is to be computed again.
    pub(crate) fn chooses(&self, job: usize) -> bool {
        let number = self.number(self.lock().round, job);
        self.share >= 1.0 || (number as f64) < self.share * u64::MAX as f64
    }

    /// A job of each worker of whom none was computed again in this solve.
    pub(crate) fn of_others(&self) -> Vec<usize> {
        if self.share == 0.0 {
            return Vec::new();
        }
        let ledger = self.lock();
        let mut least: BTreeMap<&Arc<str>, (u64, usize)> = BTreeMap::new();
        for (&job, (said, _)) in &ledger.said {
            if !ledger.audited.contains(&said.worker) {
                let found = (self.number(ledger.round, job), job);
                let best = least.entry(&said.worker).or_insert(found);
                *best = found.min(*best);
            }
        }
        least.into_values().map(|(_, job)| job).collect()
    }

    /// Compares what a worker said of a job with what it is: gives the worker if it was wrong.
    pub(crate) fn compare(&self, job: usize, rows: &JobRows) -> Option<Arc<str>> {
        let mut ledger = self.lock();
        let (said, audited) = ledger.said.get_mut(&job)?;
        let same = match rows {
            JobRows::Packed(rows) => {
                *blake3::hash(&rows.packed).as_bytes() == said.checksum
                    && rows.counts == said.counts
            }
            // jobs of workers are packed
            JobRows::Plain(_) => false,
        };
        *audited = same;
        let worker = said.worker.clone();
        if same {
            ledger.audited.insert(worker);
            return None;
        }
        ledger.failed();
        Some(worker)
    }

    /// Who brought a job of this round.
    pub(crate) fn origin(&self, job: usize) -> Option<Origin> {
        let ledger = self.lock();
        let (said, audited) = ledger.said.get(&job)?;
        Some(Origin {
            worker: said.worker.clone(),
            audited: *audited,
        })
    }

    /// A number for a job, which nobody else knows.
    fn number(&self, round: u64, job: usize) -> u64 {
        self.key.hash_one((round, job))
    }

    fn lock(&self) -> MutexGuard<'_, Ledger> {
        // what is noted is whole at any time
        self.ledger.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(worker: &str) -> Said {
        Said {
            worker: worker.into(),
            checksum: [0; 32],
            counts: Counts::default(),
        }
    }

    #[test]
    fn about_the_share_is_chosen_and_each_time_others() {
        let chosen = || {
            let audits = Audits::new(0.01);
            audits.begin();
            (0..10_000)
                .filter(|&job| audits.chooses(job))
                .collect::<Vec<_>>()
        };
        let (first, second) = (chosen(), chosen());
        assert!((40..200).contains(&first.len()), "{}", first.len());
        assert_ne!(first, second);
    }

    #[test]
    fn everybody_is_audited_once_and_nobody_where_nothing_is_to_be() {
        let audits = Audits::new(1e-9);
        audits.begin();
        for job in 0..20 {
            audits.brought(job, said(["a", "b"][job % 2]));
        }
        let chosen = audits.of_others();
        assert_eq!(chosen.len(), 2);
        assert_ne!(chosen[0] % 2, chosen[1] % 2);
        // in another round too, but only who has not been
        let none = Audits::new(0.0);
        none.begin();
        none.brought(0, said("a"));
        assert!(none.of_others().is_empty() && !none.chooses(0));
    }
}
