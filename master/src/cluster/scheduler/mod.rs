//! Who computes which job: the state, without clock or network. Time is an argument.
//!
//! A job waits, or is leased to workers, or is done. A lease ends with a result, when it is given back,
//! or when it was not renewed in time. Jobs are given out largest first; when none waits, a job that
//! takes longer than it should is given out a second time, and the first result is taken: all of them
//! have the same bits.

mod choice;
mod solve;
#[cfg(test)]
mod tests;
mod worker;

use std::collections::BTreeMap;
use std::time::Duration;

use thiserror::Error;

use solve::Solve;
pub use solve::{Outcome, SolveCounts};
use worker::Worker;
pub use worker::{WorkerCounts, WorkerFacts};

/// Content of a block: names it among all solves.
pub type BlockId = [u8; 32];

/// Numbers of workers, solves and leases; none is used twice.
pub type Id = u64;

/// A point in time, since any beginning.
pub type Time = Duration;

/// Times and counts that rule the scheduler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// A lease that was not renewed for so long is lost.
    pub lease: Duration,
    /// A job that failed or was lost so often on one worker is not given to it again.
    pub failures_on_a_worker: u32,
    /// A job that failed or was lost so often altogether fails its solve.
    pub failures_of_a_job: u32,
    /// A job is given out a second time when it takes so many times what it should, and at least
    /// `least_straggle`.
    pub straggle: f64,
    /// See `straggle`.
    pub least_straggle: Duration,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            lease: Duration::from_secs(30),
            failures_on_a_worker: 2,
            failures_of_a_job: 8,
            straggle: 2.0,
            least_straggle: Duration::from_secs(1),
        }
    }
}

/// A job to be done.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JobSpec {
    /// Index of its block among those of the solve.
    pub block: usize,
    /// What it is expected to take, seconds on one thread.
    pub cost_s: f64,
}

/// A block of a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockSpec {
    /// Its content.
    pub id: BlockId,
    /// What a worker needs to hold it and to compute its jobs.
    pub demand: nestrad_worker::Demand,
}

/// A job in the hands of a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leased {
    /// Number of the lease.
    pub lease: Id,
    /// Its solve.
    pub solve: Id,
    /// Index of the job in the solve.
    pub job: usize,
    /// Index of the block in the solve.
    pub block: usize,
}

/// Why a worker is turned away.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum Refusal {
    /// It never joined, left, or was silent for too long.
    #[error("worker {0} is not known: join anew")]
    UnknownWorker(Id),
    /// It never had this lease, or is done with it.
    #[error("lease {0} is not known")]
    UnknownLease(Id),
    /// It has as many jobs as it can compute and return.
    #[error("worker holds {0} leases: no more at a time")]
    TooMany(usize),
}

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

/// A job that was given out.
#[derive(Clone, Copy, Debug)]
struct Lease {
    worker: Id,
    solve: Id,
    job: usize,
    since: Time,
    /// When it is lost; `None` once it is: its result is welcome for as long as the job is not done.
    until: Option<Time>,
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

    /// A job for a worker, which holds these blocks; `None` where there is nothing to do now.
    pub fn lease(
        &mut self,
        now: Time,
        worker: Id,
        held: &[BlockId],
    ) -> Result<Option<Leased>, Refusal> {
        let known = self.contact(now, worker)?;
        if known.leases.len() >= known.most_leases() {
            return Err(Refusal::TooMany(known.leases.len()));
        }
        let Some((solve, job)) = self.choose(now, worker, held) else {
            return Ok(None);
        };
        let lease = self.new_id();
        let until = Some(now + self.rules.lease);
        self.leases.insert(
            lease,
            Lease {
                worker,
                solve,
                job,
                since: now,
                until,
            },
        );
        if let Some(known) = self.workers.get_mut(&worker) {
            known.leases.insert(lease);
        }
        let Some(of) = self.solves.get_mut(&solve) else {
            return Ok(None);
        };
        of.leased(job, lease);
        let block = of.jobs[job].spec.block;
        Ok(Some(Leased {
            lease,
            solve,
            job,
            block,
        }))
    }

    /// The heartbeat of a worker, with the leases that it believes to hold. Gives those of them that are
    /// not worth going on with.
    pub fn renew(&mut self, now: Time, worker: Id, leases: &[Id]) -> Result<Vec<Id>, Refusal> {
        self.contact(now, worker)?;
        let mut unwanted = Vec::new();
        for &id in leases {
            match self.leases.get_mut(&id).filter(|l| l.worker == worker) {
                Some(lease) if lease.until.is_some() => {
                    lease.until = Some(now + self.rules.lease);
                }
                // lost, but not done yet: its worker is still at it
                Some(_) => {}
                None => unwanted.push(id),
            }
        }
        Ok(unwanted)
    }

    /// Whether a result is wanted, before it is sent. It counts as a heartbeat.
    pub fn wanted(&mut self, now: Time, worker: Id, lease: Id) -> Result<Option<Leased>, Refusal> {
        self.contact(now, worker)?;
        let until = now + self.rules.lease;
        let Some(held) = self.leases.get_mut(&lease) else {
            return Ok(None);
        };
        if held.worker != worker {
            return Err(Refusal::UnknownLease(lease));
        }
        held.until = held.until.map(|_| until);
        let (solve, job) = (held.solve, held.job);
        Ok(self.solves.get(&solve).map(|of| Leased {
            lease,
            solve,
            job,
            block: of.jobs[job].spec.block,
        }))
    }

    /// A result is here, and good; `compute_s` is what the worker says it took. Gives the job that it is
    /// of, or nothing where another was faster or nobody waits for it.
    pub fn finish(&mut self, now: Time, worker: Id, lease: Id, compute_s: f64) -> Option<Leased> {
        self.contact(now, worker).ok()?;
        let held = self.leases.get(&lease).copied();
        let held = held.filter(|l| l.worker == worker)?;
        if let Some(known) = self.workers.get_mut(&held.worker) {
            known.counts.done += 1;
        }
        let solve = self.solves.get_mut(&held.solve)?;
        solve.took(held.job, compute_s);
        let used = solve.done(held.job);
        // other leases of the job are void
        let (workers, leases) = (&mut self.workers, &mut self.leases);
        leases.retain(|id, l| {
            let same = (l.solve, l.job) == (held.solve, held.job);
            if same {
                release(workers, l.worker, *id);
            }
            !same
        });
        used.then_some(Leased {
            lease,
            solve: held.solve,
            job: held.job,
            block: solve.jobs[held.job].spec.block,
        })
    }

    /// A worker does not want, or was not able, to do a job; or its result was refused.
    pub fn give_back(
        &mut self,
        now: Time,
        worker: Id,
        lease: Id,
        failure: Option<&str>,
    ) -> Result<(), Refusal> {
        self.contact(now, worker)?;
        let held = self.leases.get(&lease).filter(|l| l.worker == worker);
        let held = *held.ok_or(Refusal::UnknownLease(lease))?;
        self.leases.remove(&lease);
        release(&mut self.workers, worker, lease);
        // a lease that is lost has been counted
        if let Some(reason) = failure.filter(|_| held.until.is_some()) {
            self.failed(&held, reason);
        }
        if let Some(solve) = self.solves.get_mut(&held.solve) {
            solve.returned(held.job, lease);
        }
        Ok(())
    }

    /// Takes back what is overdue: leases that were not renewed, workers that are silent.
    pub fn expire(&mut self, now: Time) {
        let overdue: Vec<Id> = self
            .leases
            .iter()
            .filter(|(_, l)| l.until.is_some_and(|until| until <= now))
            .map(|(&id, _)| id)
            .collect();
        for id in overdue {
            let Some(lease) = self.leases.get_mut(&id) else {
                continue;
            };
            lease.until = None;
            let lease = *lease;
            release(&mut self.workers, lease.worker, id);
            self.failed(&lease, "was not heard of within the lease time");
            if let Some(solve) = self.solves.get_mut(&lease.solve) {
                solve.returned(lease.job, id);
            }
        }
        let silence = 2 * self.rules.lease;
        let silent: Vec<Id> = self
            .workers
            .iter()
            .filter(|(_, w)| w.heard + silence <= now)
            .map(|(&id, _)| id)
            .collect();
        for worker in silent {
            self.leave(worker);
        }
    }

    /// How a solve ended; `None` while it goes on.
    pub fn outcome(&self, solve: Id) -> Option<Outcome> {
        let of = self.solves.get(&solve)?;
        of.outcome(solve, &self.workers, &self.rules)
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

    fn contact(&mut self, now: Time, worker: Id) -> Result<&mut Worker, Refusal> {
        let known = self.workers.get_mut(&worker);
        let known = known.ok_or(Refusal::UnknownWorker(worker))?;
        known.heard = known.heard.max(now);
        Ok(known)
    }

    fn failed(&mut self, lease: &Lease, reason: &str) {
        self.lost += 1;
        let name = match self.workers.get_mut(&lease.worker) {
            Some(worker) => {
                worker.counts.lost += 1;
                *worker.failures.entry((lease.solve, lease.job)).or_default() += 1;
                worker.facts.name.clone()
            }
            None => String::new(),
        };
        if let Some(solve) = self.solves.get_mut(&lease.solve) {
            solve.failed(lease.job, &name, reason, &self.rules);
        }
    }

    fn drop_leases_of(&mut self, worker: Id) {
        let solves = &mut self.solves;
        self.leases.retain(|&id, lease| {
            if lease.worker == worker
                && let Some(solve) = solves.get_mut(&lease.solve)
            {
                solve.returned(lease.job, id);
            }
            lease.worker != worker
        });
    }
}

fn release(workers: &mut BTreeMap<Id, Worker>, worker: Id, lease: Id) {
    if let Some(known) = workers.get_mut(&worker) {
        known.leases.remove(&lease);
    }
}
