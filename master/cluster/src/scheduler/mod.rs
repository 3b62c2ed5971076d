//! Who computes which job: the state, without clock or network. Time is an argument.
//!
//! A job waits, or is leased to workers, or is done. A lease ends with a result, when it is given back,
//! or when it was not renewed in time. Jobs are given out largest first; when none waits, a job that
//! takes longer than it should is given out a second time, and the first result is taken: all of them
//! have the same bits.

mod choice;
mod leases;
mod solve;
mod terms;
#[cfg(test)]
mod tests;
mod worker;

use std::collections::BTreeMap;
use std::sync::Arc;

use leases::{Lease, release};
use solve::Solve;
pub use solve::{SolveCounts, SolveEnd};
pub use terms::{BlockId, BlockSpec, Id, JobSpec, Leased, Refusal, Rules, Time};
use worker::Worker;
pub use worker::{WorkerCounts, WorkerFacts};

/// The state of all workers, solves and leases.
#[derive(Debug)]
pub struct Scheduler {
    rules: Rules,
    next_id: Id,
    workers: BTreeMap<Id, Worker>,
    solves: BTreeMap<Id, Solve>,
    leases: BTreeMap<Id, Lease>,
    lost: u64,
}

impl Scheduler {
    /// Nothing to do and nobody to do it. Numbers begin at `first_id`: choose one that masters before
    /// this one are unlikely to have given out.
    pub fn new(rules: Rules, first_id: Id) -> Self {
        Self {
            rules,
            next_id: first_id,
            workers: BTreeMap::new(),
            solves: BTreeMap::new(),
            leases: BTreeMap::new(),
            lost: 0,
        }
    }

    fn new_id(&mut self) -> Id {
        let id = self.next_id;
        self.next_id = self.next_id.wrapping_add(1);
        id
    }

    /// A worker comes.
    pub fn join(&mut self, now: Time, facts: WorkerFacts) -> Id {
        let id = self.new_id();
        self.workers.insert(id, Worker::new(facts, now));
        id
    }

    /// A worker goes; its jobs wait again.
    pub fn leave(&mut self, worker: Id) {
        if self.workers.remove(&worker).is_some() {
            self.drop_leases_of(worker);
        }
    }

    /// New work.
    pub fn begin(&mut self, blocks: Vec<BlockSpec>, jobs: Vec<JobSpec>) -> Id {
        let id = self.new_id();
        self.solves.insert(id, Solve::new(blocks, jobs));
        id
    }

    /// Work that is not wanted any more, or that has come to its end.
    pub fn end(&mut self, solve: Id) {
        self.solves.remove(&solve);
        let workers = &mut self.workers;
        for worker in workers.values_mut() {
            worker.failures.retain(|&(of, _), _| of != solve);
        }
        self.leases.retain(|id, lease| {
            if lease.solve == solve {
                release(workers, lease.worker, *id);
            }
            lease.solve != solve
        });
    }

    /// Marks a job as done without a worker: its result was kept from before, or computed here. Whether it
    /// had none before.
    pub fn known(&mut self, solve: Id, job: usize) -> bool {
        let solve = self.solves.get_mut(&solve);
        solve.is_some_and(|solve| solve.done(job))
    }

    /// Whether there is a worker that can do what is left of a solve, or some of it.
    pub fn has_worker_for(&self, solve: Id) -> bool {
        let Some(solve) = self.solves.get(&solve) else {
            return false;
        };
        let left = |block: &usize| {
            let block = &solve.blocks[*block];
            !block.waiting.is_empty() || block.active > 0
        };
        let mut left = (0..solve.blocks.len()).filter(left);
        left.any(|block| self.workers.values().any(|w| solve.block_fits(block, w)))
    }

    /// A job that nobody is at, and its block.
    pub fn waiting(&self, solve: Id) -> Option<(usize, usize)> {
        let blocks = &self.solves.get(&solve)?.blocks;
        let mut blocks = blocks.iter().enumerate();
        blocks.find_map(|(number, block)| Some((block.waiting.first()?.1, number)))
    }

    /// How a solve ended; `None` while it goes on.
    pub fn end_of(&self, solve: Id) -> Option<SolveEnd> {
        let of = self.solves.get(&solve)?;
        of.end_of(solve, &self.workers, &self.rules)
    }

    /// Jobs of a solve by state.
    pub fn counts(&self, solve: Id) -> Option<SolveCounts> {
        self.solves.get(&solve).map(Solve::counts)
    }

    /// What the jobs that are not done should take, seconds on one thread.
    pub fn left_s(&self) -> f64 {
        self.solves.values().map(Solve::left_s).sum()
    }

    /// Leases that were lost or failed since the start.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// All workers.
    pub fn workers(&self, now: Time) -> Vec<WorkerCounts> {
        self.workers.values().map(|w| w.counts(now)).collect()
    }

    /// Memory and threads of all workers.
    pub fn facts(&self) -> impl Iterator<Item = &WorkerFacts> {
        self.workers.values().map(|w| &w.facts)
    }

    /// Who a worker is.
    pub fn identity(&self, worker: Id) -> Option<Arc<str>> {
        self.workers.get(&worker).map(|w| w.facts.identity.clone())
    }

    /// All workers of an identity go.
    pub fn dismiss(&mut self, identity: &str) {
        let of =
            |(&id, worker): (&Id, &Worker)| (*worker.facts.identity == *identity).then_some(id);
        let theirs: Vec<Id> = self.workers.iter().filter_map(of).collect();
        for worker in theirs {
            self.leave(worker);
        }
    }

    fn contact(&mut self, now: Time, worker: Id) -> Result<&mut Worker, Refusal> {
        let known = self.workers.get_mut(&worker);
        let known = known.ok_or(Refusal::UnknownWorker(worker))?;
        known.heard = known.heard.max(now);
        Ok(known)
    }
}
