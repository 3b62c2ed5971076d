//! The results of jobs, as they come in, put together into the exchange.

use nestrad_kernel::rows::Counts;

use super::join::{LaidOut, join};
use super::rows::BatchRows;
use super::source::{JobCounts, JobRows, Work};
use super::{Exchange, ExchangeError};
use crate::frame::Frame;

/// The batches of a solve, each put together as soon as its last job is in.
pub struct Assembly<'a> {
    frame: &'a Frame,
    work: &'a Work,
    /// By job, until its batch is complete.
    results: Vec<Option<JobRows>>,
    /// Jobs of each batch that are not in.
    missing: Vec<usize>,
    batches: Vec<Option<BatchRows>>,
    laid_out: LaidOut,
    counts: Counts,
}

impl<'a> Assembly<'a> {
    /// An assembly without results.
    pub fn new(frame: &'a Frame, work: &'a Work) -> Self {
        let mut missing = vec![0; work.batches.len()];
        for job in work.jobs.iter() {
            missing[job.batch as usize] += 1;
        }
        Self {
            frame,
            work,
            results: vec![None; work.jobs.len()],
            batches: vec![None; missing.len()],
            missing,
            laid_out: LaidOut::default(),
            counts: Counts::default(),
        }
    }

    /// Takes the result of a job; a second one of the same job is passed over.
    pub fn put(&mut self, job: usize, rows: JobRows) -> Result<(), ExchangeError> {
        let batch = self.work.jobs[job].batch as usize;
        if self.missing[batch] == 0 || self.results[job].is_some() {
            return Ok(());
        }
        self.counts += rows.counts();
        self.results[job] = Some(rows);
        self.missing[batch] -= 1;
        if self.missing[batch] == 0 {
            self.batches[batch] = Some(self.complete(batch as u32)?);
        }
        Ok(())
    }

    /// Joins the jobs of a batch; their results are freed.
    fn complete(&mut self, batch: u32) -> Result<BatchRows, ExchangeError> {
        let (blocks, jobs) = (&self.work.blocks, &self.work.jobs);
        let first = jobs.partition_point(|j| j.batch < batch);
        let jobs = jobs[first..].iter().zip(&mut self.results[first..]);
        let mut parts: Vec<_> = blocks.iter().map(|block| (block, Vec::new())).collect();
        for (job, result) in jobs.take_while(|(job, _)| job.batch == batch) {
            parts[job.block].1.extend(result.take());
        }
        join(self.frame, parts, &mut self.laid_out)
    }

    /// The exchange, once all jobs are in; `None` before.
    pub fn finish(self, jobs: JobCounts) -> Option<Exchange> {
        // halves are joined in the room that it leaves
        drop(self.laid_out);
        let batches: Option<Vec<BatchRows>> = self.batches.into_iter().collect();
        Some(Exchange::of_batches(batches?, self.counts, jobs))
    }
}
