//! Where rows of the exchange come from: this process, workers, results that are kept.

use std::sync::Arc;

use nestrad_kernel::job::Batch;
use nestrad_kernel::rows::Counts;
use nestrad_kernel::{PackedRows, Rows};
use serde::Serialize;

use super::ExchangeError;
use super::blocks::BlockOf;
use super::sampling::Sampling;
use super::split::{JobOf, split};
use crate::frame::Frame;
use crate::run::Run;

/// Where rows come from. Whoever traces, the same job has the same rows to the last bit.
pub trait RowSource: Sync {
    /// Whether rows are traced elsewhere, so that this process may compute something else meanwhile.
    fn is_elsewhere(&self) -> bool {
        false
    }

    /// Who traced a job whose rows were handed over; nothing where it was this process.
    fn origin(&self, _job: usize) -> Option<Origin> {
        None
    }

    /// Cuts an exchange into jobs.
    fn cut(&self, frame: &Frame, sampling: &Sampling, run: &Run) -> Result<Work, ExchangeError>;

    /// Has the jobs with these numbers traced, and hands each result to `take`, in whatever order.
    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError>;
}

/// Who traced rows, where it was not this process.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The worker.
    pub worker: Arc<str>,
    /// This process has traced them too, and found the same.
    pub audited: bool,
}

/// Takes the rows of the job of that number.
pub type Take<'a> = dyn FnMut(usize, JobRows) -> Result<(), ExchangeError> + Send + 'a;

/// An exchange, cut into jobs.
#[derive(Clone, Debug)]
pub struct Work {
    /// How densely it is sampled.
    pub sampling: Sampling,
    /// Parts of the scene.
    pub blocks: Arc<[BlockOf]>,
    /// All batches, whole.
    pub batches: Vec<Batch>,
    /// By batch, then by block.
    pub jobs: Arc<[JobOf]>,
    /// Whether rows are to be packed: they travel, or are kept.
    pub packed: bool,
    /// What the result of each job is called where results are kept; empty where they are not.
    pub names: Vec<[u8; 32]>,
}

impl Work {
    /// The whole scene as one block, and a batch a job: for who traces one batch after the other, and keeps nothing.
    pub fn by_batch(frame: &Frame, sampling: &Sampling) -> Self {
        let batches = batches(sampling);
        let jobs = batches.iter().map(JobOf::whole).collect();
        Self {
            sampling: *sampling,
            blocks: Arc::new([BlockOf::whole(frame)]),
            batches,
            jobs,
            packed: false,
            names: Vec::new(),
        }
    }

    /// Jobs of a fraction of a second each, which depend on the blocks and on the sampling alone.
    pub fn split(frame: &Frame, sampling: &Sampling, blocks: Vec<BlockOf>) -> Self {
        let batches = batches(sampling);
        let jobs = split(frame, &blocks, &batches, sampling).into();
        Self {
            sampling: *sampling,
            blocks: blocks.into(),
            batches,
            jobs,
            packed: true,
            names: Vec::new(),
        }
    }

    /// What the kernel is asked for a job.
    pub fn batch(&self, job: usize) -> Batch {
        let job = &self.jobs[job];
        job.of_batch(&self.batches[job.batch as usize])
    }
}

fn batches(sampling: &Sampling) -> Vec<Batch> {
    (0..sampling.batches)
        .map(|index| sampling.batch(index))
        .collect()
}

/// The result of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum JobRows {
    /// As the kernel gives it.
    Plain(Rows),
    /// As it travels and is kept; checked.
    Packed(Arc<PackedRows>),
}

impl JobRows {
    /// What it took.
    pub fn counts(&self) -> Counts {
        match self {
            Self::Plain(rows) => rows.counts,
            Self::Packed(rows) => rows.counts,
        }
    }
}

/// Jobs by where their results come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct JobCounts {
    /// Traced for this solve.
    pub traced: u64,
    /// Kept from an earlier one.
    pub kept: u64,
}
