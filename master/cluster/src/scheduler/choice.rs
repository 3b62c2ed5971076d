//! Which job a worker gets.

use super::solve::Solve;
use super::worker::Worker;
use super::{BlockId, Id, Rules, Scheduler, Time};

impl Scheduler {
    /// The next job for a worker: of the solve that has the fewest leases; where nothing waits, one
    /// that takes too long elsewhere.
    pub(super) fn choose(&self, now: Time, worker: Id, held: &[BlockId]) -> Option<(Id, usize)> {
        let known = self.workers.get(&worker)?;
        let mut solves: Vec<(usize, Id)> = self
            .solves
            .iter()
            .map(|(&id, solve)| (solve.active(), id))
            .collect();
        solves.sort_unstable();
        let waiting = solves.iter().find_map(|&(_, id)| {
            let job = self.solves[&id].next_waiting(known, &self.rules, held)?;
            Some((id, job))
        });
        waiting.or_else(|| self.straggler(now, worker, known))
    }

    /// The job that takes longest, against what it should, among those that others have: one more may have it where
    /// it takes twice as long, a third where it takes eight times as long, and so on.
    fn straggler(&self, now: Time, worker: Id, known: &Worker) -> Option<(Id, usize)> {
        const PATIENCE_WITH_ONE_MORE: f64 = 4.0;
        let mut worst: Option<(f64, Id, usize)> = None;
        for lease in self.leases.values().filter(|l| l.until.is_some()) {
            let Some(solve) = self.solves.get(&lease.solve) else {
                continue;
            };
            let takes_s = now.saturating_sub(lease.since).as_secs_f64();
            // what a job should take goes by what workers said; that is not to hold it back for ever
            let patience_s = (self.rules.straggle * solve.expected_s(lease.job))
                .min(self.rules.lease.as_secs_f64())
                .max(self.rules.least_straggle.as_secs_f64());
            let active = &solve.jobs[lease.job].active;
            let more = active.len().saturating_sub(1) as i32;
            let late = takes_s / (patience_s * PATIENCE_WITH_ONE_MORE.powi(more));
            let has_it = |id: &Id| self.leases.get(id).is_some_and(|l| l.worker == worker);
            if late >= 1.0
                && worst.is_none_or(|(most, ..)| late > most)
                && !active.iter().any(has_it)
                && solve.fits(lease.job, known)
                && solve.trusts(known, lease.job, &self.rules)
            {
                worst = Some((late, lease.solve, lease.job));
            }
        }
        worst.map(|(_, solve, job)| (solve, job))
    }
}

impl Solve {
    /// The largest job that waits, of the blocks that the worker holds; else of the block that has most
    /// jobs for those who work on it.
    fn next_waiting(&self, worker: &Worker, rules: &Rules, held: &[BlockId]) -> Option<usize> {
        let first_of = |block: usize| {
            let of = &self.blocks[block];
            let mut jobs = of.waiting.iter();
            jobs.find(|&&(_, job)| self.trusts(worker, job, rules))
        };
        let open = |block: &usize| {
            !self.blocks[*block].waiting.is_empty() && self.block_fits(*block, worker)
        };
        let at_hand = (0..self.blocks.len())
            .filter(|&b| held.contains(&self.blocks[b].spec.id))
            .filter(open)
            .filter_map(first_of)
            .min();
        if let Some(&(_, job)) = at_hand {
            return Some(job);
        }
        let mut others: Vec<usize> = (0..self.blocks.len()).filter(open).collect();
        others.sort_by(|&a, &b| {
            // most waiting jobs for each lease, without division
            let of = |k: usize| (self.blocks[k].waiting.len(), 1 + self.blocks[k].active);
            let ((wa, aa), (wb, ab)) = (of(a), of(b));
            (wb * aa).cmp(&(wa * ab)).then(a.cmp(&b))
        });
        others.into_iter().find_map(first_of).map(|&(_, job)| job)
    }
}
