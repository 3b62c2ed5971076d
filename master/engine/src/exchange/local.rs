//! Rows that this process traces.

use std::sync::OnceLock;

use nestrad_kernel::{Block, Tracer, trace};
use rayon::prelude::*;

use super::ExchangeError;
use super::blocks::BlockOf;
use super::sampling::Sampling;
use super::source::{JobCounts, JobRows, RowSource, Take, Work};
use crate::frame::Frame;
use crate::run::Run;

/// This process.
#[derive(Clone, Copy, Debug, Default)]
pub struct ThisProcess {
    /// Traces within a sphere of another radius than the frame's, metres.
    radius_m: Option<f64>,
}

impl ThisProcess {
    /// Traces as if the sphere of near exchange had no end.
    pub fn without_end() -> Self {
        Self {
            radius_m: Some(f64::INFINITY),
        }
    }
}

impl RowSource for ThisProcess {
    fn cut(&self, frame: &Frame, sampling: &Sampling, _: &Run) -> Result<Work, ExchangeError> {
        Ok(Work::by_batch(frame, sampling))
    }

    /// One batch after the other, its jobs at the same time: no more than a batch lies about unjoined.
    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        let ready = work.blocks.iter().map(|block| {
            let ready = Ready::of(block, frame)?;
            Ok(match self.radius_m {
                Some(radius_m) => ready.within(radius_m),
                None => ready,
            })
        });
        let ready = ready.collect::<Result<Vec<_>, ExchangeError>>()?;
        let batch = |job: &usize| work.jobs[*job].batch;
        for jobs in wanted.chunk_by(|a, b| batch(a) == batch(b)) {
            let rows = jobs.par_iter().map(|&job| {
                run.stop.check()?;
                Ok(ready[work.jobs[job].block].rows(work, job))
            });
            let rows: Vec<JobRows> = rows.collect::<Result<_, ExchangeError>>()?;
            for (&job, rows) in jobs.iter().zip(rows) {
                take(job, rows)?;
            }
        }
        Ok(JobCounts {
            traced: wanted.len() as u64,
            kept: 0,
        })
    }
}

/// A block in the hands of this process.
pub struct Ready {
    block: Block,
    /// Built by the first job that casts rays.
    tracer: OnceLock<Tracer>,
}

impl Ready {
    /// Makes a block ready.
    pub fn of(block: &BlockOf, frame: &Frame) -> Result<Self, ExchangeError> {
        Ok(Self {
            block: block.ready(frame)?,
            tracer: OnceLock::new(),
        })
    }

    /// The same with a sphere of another radius, metres.
    fn within(self, radius_m: f64) -> Self {
        Self {
            block: self.block.within(radius_m),
            ..self
        }
    }

    /// The rows of a job of this block.
    pub fn rows(&self, work: &Work, job: usize) -> JobRows {
        let tracer = || self.tracer.get_or_init(|| Tracer::new(&self.block));
        let seen = trace(&self.block, tracer, &work.batch(job));
        if work.packed {
            JobRows::Packed(seen.packed(&self.block).into())
        } else {
            JobRows::Plain(seen.rows(&self.block))
        }
    }
}
