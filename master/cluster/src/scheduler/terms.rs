//! What the scheduler speaks of.

use std::time::Duration;

use thiserror::Error;

/// Content of a block: names it among all solves.
pub type BlockId = [u8; 32];

/// Who a worker is, however often it leaves and joins again.
pub type Identity = [u8; 32];

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
    /// A job that failed or was lost on so many workers is computed by the master, unless another is faster.
    pub workers_failing_a_job: usize,
    /// A job is given out a second time when it takes so many times what it should, and at least
    /// `least_straggle`; whatever it should take, after a lease time. To a third worker after four times that
    /// time, and so on.
    pub straggle: f64,
    /// See `straggle`.
    pub least_straggle: Duration,
}

impl Default for Rules {
    fn default() -> Self {
        Self {
            lease: Duration::from_secs(30),
            failures_on_a_worker: 2,
            workers_failing_a_job: 3,
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
    pub demand: nestrad_kernel::Demand,
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
    #[error("worker {0} is not known: join again")]
    UnknownWorker(Id),
    /// It never had this lease, or is done with it.
    #[error("lease {0} is not known")]
    UnknownLease(Id),
    /// It has as many jobs as it can compute and return.
    #[error("worker holds {0} leases: no more at a time")]
    TooMany(usize),
}
