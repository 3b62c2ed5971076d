//! The exchange matrix: batches of directions are cut into jobs, a row source has them traced, and their rows are
//! put together.

mod assembly;
mod blocks;
mod far;
mod join;
mod local;
mod outlook;
mod partition;
mod rows;
mod sampling;
mod source;
mod split;

use nestrad_kernel::BlockFault;
use nestrad_kernel::packed::PackedFault;
use nestrad_kernel::rows::Counts;
use thiserror::Error;

pub use assembly::Assembly;
pub use blocks::BlockOf;
pub use far::{FarRows, FarSampling};
pub use local::{Ready, ThisProcess};
pub use outlook::Outlook;
pub use partition::{SmallestWorker, partition};
pub use rows::{BatchRows, HalfRows};
pub use sampling::{HALF_BATCHES, Sampling, lines_along};
pub use source::{JobCounts, JobRows, Origin, RowSource, Take, Work};
pub use split::{JobOf, demand};

use crate::frame::Frame;
use crate::run::Run;
use crate::stop::Stopped;

/// All batches, and what it took to trace them.
#[derive(Clone, Debug, Default)]
pub struct Exchange {
    /// The first half of the batches carries light one way, the second half the other way.
    pub halves: [HalfRows; 2],
    /// Lines, segments between hits, rays.
    pub counts: Counts,
    /// Jobs that it took.
    pub jobs: JobCounts,
}

impl Exchange {
    /// Has all batches traced by a row source: this is the one loop over jobs.
    pub fn trace(
        frame: &Frame,
        sampling: &Sampling,
        rows: &dyn RowSource,
        run: &Run,
    ) -> Result<Self, ExchangeError> {
        let work = rows.cut(frame, sampling, run)?;
        run.progress.stage("exchange", work.jobs.len() as u64);
        let mut assembly = Assembly::new(frame, &work);
        let all: Vec<usize> = (0..work.jobs.len()).collect();
        let mut take = |job, rows| {
            assembly.put(job, rows)?;
            run.progress.inc(1);
            run.stop.check()?;
            Ok(())
        };
        let counts = rows.trace(frame, &work, &all, &mut take, run)?;
        assembly
            .finish(counts)
            .ok_or_else(|| ExchangeError::Failed("jobs without result".to_owned()))
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        self.halves.iter().map(HalfRows::bytes).sum()
    }

    /// Joins all batches.
    fn of_batches(mut batches: Vec<BatchRows>, counts: Counts, jobs: JobCounts) -> Self {
        // each half's batches are freed before the other half is joined
        let second = batches.split_off(batches.len() / 2);
        let first = HalfRows::join(batches);
        Self {
            halves: [first, HalfRows::join(second)],
            counts,
            jobs,
        }
    }
}

/// Why the exchange could not be computed.
#[derive(Debug, Error)]
pub enum ExchangeError {
    /// The kernel refused a block.
    #[error("near-field job refused")]
    Block(#[from] BlockFault),
    /// The row source could not do it.
    #[error("{0}")]
    Failed(String),
    /// Packed rows cannot be read.
    #[error("near-field result cannot be read")]
    Packed(#[from] PackedFault),
    /// No cut of the scene into blocks is small enough for a worker.
    #[error(
        "a worker needs {needed_GiB:.2} GiB for the smallest block of this scene, but the smallest worker has \
         {limit_GiB:.2} GiB: give workers more memory{}", if *.bounded { "" } else { " or choose a --diameter" }
    )]
    BlockTooLarge {
        /// What the smallest block that was tried takes.
        needed_GiB: f64,
        /// What a worker may take.
        limit_GiB: f64,
        /// Whether the near field has a bound.
        bounded: bool,
    },
    /// A result does not fit its job.
    #[error("near-field result has {found} {what}, expected {expected}")]
    Result {
        /// What is wrong.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// Rows of a worker are wrong, and it had brought others: all is to be done anew, without it.
    #[error("worker {worker} returned wrong rows")]
    Distrusted {
        /// Who it is.
        worker: String,
    },
    /// It is not wanted any more.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}
