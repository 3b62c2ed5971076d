//! The life of a lease: given out, renewed, ended by a result, by its worker, or by time.

use std::collections::BTreeMap;

use super::worker::Worker;
use super::{BlockId, Id, Leased, Refusal, Scheduler, Time};

/// A job that was given out.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lease {
    pub(super) worker: Id,
    pub(super) solve: Id,
    pub(super) job: usize,
    pub(super) since: Time,
    /// When it is lost; `None` once it is: its result is welcome for as long as the job is not done.
    pub(super) until: Option<Time>,
}

impl Scheduler {
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
        if !known.may_lease() {
            return Ok(None);
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
            known.told = None;
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
        // it cannot have taken longer than since it was given out
        let most_s = now.saturating_sub(held.since).as_secs_f64();
        solve.took(held.job, compute_s.min(most_s));
        let used = solve.done(held.job);
        let block = solve.jobs[held.job].spec.block;
        self.void_leases(held.solve, held.job);
        used.then_some(Leased {
            lease,
            solve: held.solve,
            job: held.job,
            block,
        })
    }

    /// Takes back all leases of a job that is done.
    pub(super) fn void_leases(&mut self, solve: Id, job: usize) {
        let (workers, leases) = (&mut self.workers, &mut self.leases);
        leases.retain(|id, l| {
            let same = (l.solve, l.job) == (solve, job);
            if same {
                release(workers, l.worker, *id);
            }
            !same
        });
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
            self.failed(&lease, "sent nothing within the lease time");
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
            self.leave(now, worker);
        }
    }

    fn failed(&mut self, lease: &Lease, reason: &str) {
        self.lost += 1;
        let Some(worker) = self.workers.get_mut(&lease.worker) else {
            return;
        };
        worker.counts.lost += 1;
        if let Some(solve) = self.solves.get_mut(&lease.solve) {
            solve.failed(lease.job, &worker.facts, reason);
        }
    }

    pub(super) fn drop_leases_of(&mut self, worker: Id) {
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

pub(super) fn release(workers: &mut BTreeMap<Id, Worker>, worker: Id, lease: Id) {
    if let Some(known) = workers.get_mut(&worker) {
        known.leases.remove(&lease);
    }
}
