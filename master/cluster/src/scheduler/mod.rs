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

use leases::{Lease, release};
use solve::Solve;
pub use solve::SolveCounts;
pub use terms::{BlockId, BlockSpec, Id, Identity, JobSpec, Leased, Refusal, Rules, Time};
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
    /// Since when there has been no worker at all.
    deserted: Option<Time>,
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
            deserted: Some(Time::ZERO),
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
        self.deserted = None;
        id
    }

    /// A worker goes; its jobs wait again.
    pub fn leave(&mut self, now: Time, worker: Id) {
        if self.workers.remove(&worker).is_some() {
            self.drop_leases_of(worker);
            if self.workers.is_empty() {
                self.deserted = Some(now);
            }
        }
    }

    /// Nobody is there any more.
    pub fn all_leave(&mut self, now: Time) {
        let all: Vec<Id> = self.workers.keys().copied().collect();
        for worker in all {
            self.leave(now, worker);
        }
    }

    /// How long there has been no worker at all; `None` where there is one.
    pub fn deserted_for(&self, now: Time) -> Option<Time> {
        self.deserted.map(|since| now.saturating_sub(since))
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
        let of = self.solves.get_mut(&solve);
        let first = of.is_some_and(|of| of.done(job));
        self.void_leases(solve, job);
        first
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

    /// Jobs of one block that nobody is at, a few; where there are none, those that others have had for longest, and
    /// for more than a moment.
    pub fn for_the_master(&self, now: Time, solve: Id, most: usize) -> Vec<usize> {
        let Some(of) = self.solves.get(&solve) else {
            return Vec::new();
        };
        let waiting = of.blocks.iter().find(|block| !block.waiting.is_empty());
        if let Some(block) = waiting {
            let jobs = block.waiting.iter().map(|&(_, job)| job);
            return jobs.take(most).collect();
        }
        let old = |lease: &&Lease| {
            let is_old = now.saturating_sub(lease.since) >= self.rules.least_straggle;
            lease.solve == solve && is_old && !of.jobs[lease.job].done
        };
        let mut since = BTreeMap::new();
        for lease in self.leases.values().filter(old) {
            let first = since.entry(lease.job).or_insert(lease.since);
            *first = lease.since.min(*first);
        }
        let mut held: Vec<(Time, usize)> = since.into_iter().map(|(job, at)| (at, job)).collect();
        held.sort_unstable();
        let Some(&(_, first)) = held.first() else {
            return Vec::new();
        };
        let same_block = |job: &usize| of.jobs[*job].spec.block == of.jobs[first].spec.block;
        let jobs = held.into_iter().map(|(_, job)| job).filter(same_block);
        jobs.take(most).collect()
    }

    /// A job that failed on several workers, or on every worker that could do it, and why it failed last. Nobody is
    /// kept from it, but it is not to wait for another.
    pub fn failing(&self, solve: Id) -> Option<(usize, &str)> {
        let of = self.solves.get(&solve)?;
        of.failing(&self.workers, &self.rules)
    }

    /// Memory that the smallest block needs of a worker, bytes, where that has less: it gets no job of any solve.
    fn too_small_for(&self, worker: &Worker) -> Option<u64> {
        let needs = self.solves.values().filter_map(|of| of.least_bytes(worker));
        needs
            .min()
            .filter(|&bytes| bytes > worker.facts.memory_bytes)
    }

    /// What a worker lacks memory for, bytes, and whether it has not been told so yet.
    pub fn tell_too_small(&mut self, worker: Id) -> Option<(u64, bool)> {
        let needs = self.too_small_for(self.workers.get(&worker)?)?;
        let known = self.workers.get_mut(&worker)?;
        let is_news = known.told != Some(needs);
        known.told = Some(needs);
        Some((needs, is_news))
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
        let all = self.workers.values();
        all.map(|w| w.counts(now, self.too_small_for(w))).collect()
    }

    /// Memory and threads of all workers.
    pub fn facts(&self) -> impl Iterator<Item = &WorkerFacts> {
        self.workers.values().map(|w| &w.facts)
    }

    /// What a worker said of itself.
    pub fn facts_of(&self, worker: Id) -> Option<&WorkerFacts> {
        self.workers.get(&worker).map(|w| &w.facts)
    }

    /// All workers that are called so go.
    pub fn dismiss(&mut self, now: Time, who: &str) {
        let of = |(&id, worker): (&Id, &Worker)| (*worker.facts.who == *who).then_some(id);
        let theirs: Vec<Id> = self.workers.iter().filter_map(of).collect();
        for worker in theirs {
            self.leave(now, worker);
        }
    }

    fn contact(&mut self, now: Time, worker: Id) -> Result<&mut Worker, Refusal> {
        let known = self.workers.get_mut(&worker);
        let known = known.ok_or(Refusal::UnknownWorker(worker))?;
        known.heard = known.heard.max(now);
        Ok(known)
    }
}
