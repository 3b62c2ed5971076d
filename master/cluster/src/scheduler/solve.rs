//! The jobs of one solve.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::AddAssign;

use super::worker::Worker;
use super::{BlockSpec, Id, JobSpec, Rules};

/// How a solve stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SolveEnd {
    /// All jobs are done.
    Done,
    /// A job cannot be done; the reason.
    Failed(String),
}

/// Jobs of a solve by state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SolveCounts {
    /// Wait for a worker.
    pub waiting: usize,
    /// Are with one, or with two.
    pub leased: usize,
    /// Are done.
    pub done: usize,
}

impl AddAssign for SolveCounts {
    fn add_assign(&mut self, more: Self) {
        self.waiting += more.waiting;
        self.leased += more.leased;
        self.done += more.done;
    }
}

#[derive(Debug)]
pub(super) struct Solve {
    pub(super) blocks: Vec<Block>,
    pub(super) jobs: Vec<Job>,
    /// Jobs that are not done, and have failed.
    suspects: BTreeSet<usize>,
    failed: Option<String>,
    left: usize,
    /// What finished jobs took, and were expected to take, seconds.
    took_s: f64,
    cost_s: f64,
}

#[derive(Debug)]
pub(super) struct Block {
    pub(super) spec: BlockSpec,
    /// Jobs that wait, largest first.
    pub(super) waiting: BTreeSet<(Reverse<u64>, usize)>,
    /// Leases of its jobs.
    pub(super) active: usize,
}

#[derive(Debug)]
pub(super) struct Job {
    pub(super) spec: JobSpec,
    /// Leases that are not lost.
    pub(super) active: BTreeSet<Id>,
    pub(super) done: bool,
    failures: u32,
    last_reason: String,
}

impl Solve {
    pub(super) fn new(blocks: Vec<BlockSpec>, jobs: Vec<JobSpec>) -> Self {
        let mut solve = Self {
            blocks: blocks
                .into_iter()
                .map(|spec| Block {
                    spec,
                    waiting: BTreeSet::new(),
                    active: 0,
                })
                .collect(),
            left: jobs.len(),
            jobs: jobs
                .into_iter()
                .map(|spec| Job {
                    spec,
                    active: BTreeSet::new(),
                    done: false,
                    failures: 0,
                    last_reason: String::new(),
                })
                .collect(),
            suspects: BTreeSet::new(),
            failed: None,
            took_s: 0.0,
            cost_s: 0.0,
        };
        for job in 0..solve.jobs.len() {
            solve.wait(job);
        }
        solve
    }

    fn wait(&mut self, job: usize) {
        let spec = self.jobs[job].spec;
        self.blocks[spec.block]
            .waiting
            .insert((key(spec.cost_s), job));
    }

    fn wait_no_more(&mut self, job: usize) {
        let spec = self.jobs[job].spec;
        self.blocks[spec.block]
            .waiting
            .remove(&(key(spec.cost_s), job));
    }

    pub(super) fn leased(&mut self, job: usize, lease: Id) {
        self.wait_no_more(job);
        if self.jobs[job].active.insert(lease) {
            self.blocks[self.jobs[job].spec.block].active += 1;
        }
    }

    /// A lease has ended without a result.
    pub(super) fn returned(&mut self, job: usize, lease: Id) {
        if self.jobs[job].active.remove(&lease) {
            self.blocks[self.jobs[job].spec.block].active -= 1;
            if !self.jobs[job].done && self.jobs[job].active.is_empty() {
                self.wait(job);
            }
        }
    }

    /// A job has its result; whether it had none before.
    pub(super) fn done(&mut self, job: usize) -> bool {
        if self.jobs[job].done {
            return false;
        }
        self.wait_no_more(job);
        let of = &mut self.jobs[job];
        of.done = true;
        let active = std::mem::take(&mut of.active).len();
        self.blocks[of.spec.block].active -= active;
        self.suspects.remove(&job);
        self.left -= 1;
        true
    }

    pub(super) fn failed(&mut self, job: usize, worker: &str, reason: &str, rules: &Rules) {
        let of = &mut self.jobs[job];
        if of.done {
            return;
        }
        of.failures += 1;
        of.last_reason = format!("worker '{worker}': {reason}");
        self.suspects.insert(job);
        if of.failures >= rules.failures_of_a_job {
            self.failed = Some(format!(
                "near-field job {job} failed {} times, last on {}",
                of.failures, of.last_reason
            ));
        }
    }

    pub(super) fn took(&mut self, job: usize, compute_s: f64) {
        if compute_s.is_finite() && compute_s >= 0.0 {
            self.took_s += compute_s;
            self.cost_s += self.jobs[job].spec.cost_s;
        }
    }

    /// What a job should take, seconds, going by those that are done.
    pub(super) fn expected_s(&self, job: usize) -> f64 {
        let factor = if self.cost_s > 0.0 {
            self.took_s / self.cost_s
        } else {
            1.0
        };
        factor * self.jobs[job].spec.cost_s
    }

    pub(super) fn left_s(&self) -> f64 {
        let left = self.jobs.iter().enumerate().filter(|(_, job)| !job.done);
        left.map(|(k, _)| self.expected_s(k)).sum()
    }

    /// How the solve ends, once it does.
    pub(super) fn end_of(
        &self,
        id: Id,
        workers: &BTreeMap<Id, Worker>,
        rules: &Rules,
    ) -> Option<SolveEnd> {
        if let Some(reason) = &self.failed {
            return Some(SolveEnd::Failed(reason.clone()));
        }
        if self.left == 0 {
            return Some(SolveEnd::Done);
        }
        let hopeless = self.suspects.iter().find(|&&job| {
            self.jobs[job].active.is_empty()
                && workers.values().any(|w| self.fits(job, w))
                && workers
                    .values()
                    .filter(|w| self.fits(job, w))
                    .all(|w| !w.trusted_with(id, job, rules))
        })?;
        Some(SolveEnd::Failed(format!(
            "near-field job {hopeless} failed on every worker, last on {}",
            self.jobs[*hopeless].last_reason
        )))
    }

    /// Whether a worker has the memory for a job.
    pub(super) fn fits(&self, job: usize, worker: &Worker) -> bool {
        self.block_fits(self.jobs[job].spec.block, worker)
    }

    pub(super) fn block_fits(&self, block: usize, worker: &Worker) -> bool {
        let facts = &worker.facts;
        let demand = &self.blocks[block].spec.demand;
        demand.worker_bytes(facts.threads, 1) <= facts.memory_bytes
    }

    /// Leases of all jobs.
    pub(super) fn active(&self) -> usize {
        self.blocks.iter().map(|b| b.active).sum()
    }

    pub(super) fn counts(&self) -> SolveCounts {
        let waiting = self.blocks.iter().map(|b| b.waiting.len()).sum();
        SolveCounts {
            waiting,
            leased: self.left - waiting,
            done: self.jobs.len() - self.left,
        }
    }
}

/// Orders costs, which are not negative, the largest first; those that differ by less than half are alike.
/// Jobs that are alike go out in their order, batch after batch: so the master joins the first batches while
/// the last ones are traced.
fn key(cost_s: f64) -> Reverse<u64> {
    const KEPT_BITS: u32 = 1;
    let bits = cost_s.max(0.0).to_bits();
    Reverse(bits >> (f64::MANTISSA_DIGITS - 1 - KEPT_BITS))
}
