//! The results of jobs, as they come in, put together into the exchange.

use std::sync::Arc;

use bytes::Bytes;
use nestrad_worker::PackedRows;

use super::jobs::BlockOf;
use super::join::{LaidOut, join};
use super::rows::BatchRows;
use super::split::JobOf;
use super::{Exchange, ExchangeError, JobCounts, Traced};
use crate::world::World;

/// The result of a job, packed and checked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct JobRows {
    /// See `RowsHeader` in the protocol.
    pub packed: Bytes,
    /// What the kernel did.
    pub traced: Traced,
}

impl From<PackedRows> for JobRows {
    fn from(rows: PackedRows) -> Self {
        Self {
            packed: rows.packed.into(),
            traced: Traced {
                lines: rows.lines,
                segments: rows.segments,
                rays: rows.rays,
                row_entries: rows.entries,
            },
        }
    }
}

/// The batches of a solve, each put together as soon as its last job is in.
pub struct Assembly<'a> {
    world: &'a World,
    blocks: &'a [BlockOf],
    jobs: Arc<[JobOf]>,
    /// By job, until its batch is complete.
    results: Vec<Option<JobRows>>,
    /// Jobs of each batch that are not in.
    missing: Vec<usize>,
    batches: Vec<Option<BatchRows>>,
    laid_out: LaidOut,
    counters: Traced,
}

impl<'a> Assembly<'a> {
    /// An assembly without results. Jobs stand by batch.
    pub fn new(world: &'a World, blocks: &'a [BlockOf], jobs: Arc<[JobOf]>, batches: u32) -> Self {
        let mut missing = vec![0; batches as usize];
        for job in jobs.iter() {
            missing[job.batch as usize] += 1;
        }
        Self {
            world,
            blocks,
            results: vec![None; jobs.len()],
            jobs,
            missing,
            batches: vec![None; batches as usize],
            laid_out: LaidOut::default(),
            counters: Traced::default(),
        }
    }

    /// Takes the result of a job; a second one of the same job is passed over.
    pub fn put(&mut self, job: usize, rows: JobRows) -> Result<(), ExchangeError> {
        let batch = self.jobs[job].batch as usize;
        if self.missing[batch] == 0 || self.results[job].is_some() {
            return Ok(());
        }
        self.counters += rows.traced;
        self.results[job] = Some(rows);
        self.missing[batch] -= 1;
        if self.missing[batch] == 0 {
            self.batches[batch] = Some(self.complete(batch as u32)?);
        }
        Ok(())
    }

    /// Joins the jobs of a batch; their results are freed.
    fn complete(&mut self, batch: u32) -> Result<BatchRows, ExchangeError> {
        let first = self.jobs.partition_point(|j| j.batch < batch);
        let jobs = self.jobs[first..].iter().zip(&mut self.results[first..]);
        let mut parts: Vec<(&BlockOf, Vec<JobRows>)> = self
            .blocks
            .iter()
            .map(|block| (block, Vec::new()))
            .collect();
        for (job, result) in jobs.take_while(|(job, _)| job.batch == batch) {
            parts[job.block].1.extend(result.take());
        }
        Ok(join(self.world, &parts, &mut self.laid_out)?)
    }

    /// The exchange, once all jobs are in; `None` before.
    pub fn finish(self, jobs: JobCounts) -> Option<Exchange> {
        // halves are joined in the room that it leaves
        drop(self.laid_out);
        let batches: Option<Vec<BatchRows>> = self.batches.into_iter().collect();
        Some(Exchange::of_batches(batches?, self.counters, jobs))
    }
}
