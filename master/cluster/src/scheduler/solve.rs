//! The jobs of one solve.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::AddAssign;

use super::worker::{Worker, WorkerFacts};
use super::{BlockSpec, Id, Identity, JobSpec, Rules};

/// Workers that are remembered to have failed a job.
const MOST_REMEMBERED: usize = 64;

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
    /// Who failed it how often.
    failures: Vec<(Identity, u32)>,
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
                    failures: Vec::new(),
                    last_reason: String::new(),
                })
                .collect(),
            suspects: BTreeSet::new(),
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

    pub(super) fn failed(&mut self, job: usize, worker: &WorkerFacts, reason: &str) {
        let of = &mut self.jobs[job];
        if of.done {
            return;
        }
        let own = of
            .failures
            .iter()
            .position(|(who, _)| *who == worker.identity);
        if let Some(own) = own {
            of.failures[own].1 += 1;
        } else if of.failures.len() < MOST_REMEMBERED {
            of.failures.push((worker.identity, 1));
        }
        of.last_reason = format!("worker '{}': {reason}", worker.name);
        self.suspects.insert(job);
    }

    /// Whether a worker did not fail a job too often, under whatever number.
    pub(super) fn trusts(&self, worker: &Worker, job: usize, rules: &Rules) -> bool {
        let mut failures = self.jobs[job].failures.iter();
        let own = failures.find(|(who, _)| *who == worker.facts.identity);
        own.is_none_or(|&(_, times)| times < rules.failures_on_a_worker)
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

    /// A job that failed on several workers, or on every one that could do it, and why it failed last.
    pub(super) fn failing(
        &self,
        workers: &BTreeMap<Id, Worker>,
        rules: &Rules,
    ) -> Option<(usize, &str)> {
        let job = *self.suspects.iter().find(|&&job| {
            let is_stuck = || {
                let mut fitting = workers.values().filter(|w| self.fits(job, w)).peekable();
                fitting.peek().is_some() && fitting.all(|w| !self.trusts(w, job, rules))
            };
            let of = &self.jobs[job];
            of.failures.len() >= rules.workers_failing_a_job || (of.active.is_empty() && is_stuck())
        })?;
        Some((job, &self.jobs[job].last_reason))
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

    /// Memory that a worker needs for the smallest block of which there is something to do, bytes.
    pub(super) fn least_bytes(&self, worker: &Worker) -> Option<u64> {
        let left = |block: &&Block| !block.waiting.is_empty() || block.active > 0;
        let blocks = self.blocks.iter().filter(left);
        let needs = blocks.map(|block| block.spec.demand.worker_bytes(worker.facts.threads, 1));
        needs.min()
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
