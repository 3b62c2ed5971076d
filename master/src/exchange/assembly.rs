//! The results of jobs, as they come in, put together into the exchange.

use std::sync::Arc;

use bytes::Bytes;
use nestrad_proto::packed::{self, PackedFault};
use nestrad_proto::v1;
use rayon::prelude::*;

use super::jobs::BlockOf;
use super::rows::{BatchRows, put_together};
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

impl JobRows {
    /// Packs what the kernel gave.
    pub fn pack(rows: &v1::Rows, ends: usize) -> Self {
        Self {
            packed: packed::pack(rows, packed::end_bytes(ends)).into(),
            traced: Traced {
                lines: rows.lines,
                segments: rows.segments,
                rays: rows.rays,
                row_entries: rows.ends.len() as u64,
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
    counters: Traced,
}

impl<'a> Assembly<'a> {
    /// An assembly without results. Jobs stand by batch, then by block, in the order in which their rows
    /// are joined.
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

    /// Joins the jobs of each block, then the blocks; their results are freed.
    fn complete(&mut self, batch: u32) -> Result<BatchRows, ExchangeError> {
        let end_bytes = packed::end_bytes(self.world.ends.len());
        let mut job = self.jobs.partition_point(|j| j.batch < batch);
        let mut parts = Vec::with_capacity(self.blocks.len());
        for (number, block) in self.blocks.iter().enumerate() {
            let mut results = Vec::new();
            while let Some(next) = self.jobs.get(job)
                && (next.batch, next.block) == (batch, number)
            {
                results.extend(self.results[job].take());
                job += 1;
            }
            parts.push((block, results));
        }
        let joined: Result<Vec<(&BlockOf, v1::Rows)>, PackedFault> = parts
            .into_par_iter()
            .map(|(block, results)| {
                let packed: Vec<&[u8]> = results.iter().map(|r| &r.packed[..]).collect();
                let rows = packed::join(&packed, block.rows(self.world).len(), end_bytes)?;
                Ok((block, rows))
            })
            .collect();
        put_together(self.world, batch, joined?)
    }

    /// The exchange, once all jobs are in; `None` before.
    pub fn finish(self, jobs: JobCounts) -> Option<Exchange> {
        let batches: Option<Vec<BatchRows>> = self.batches.into_iter().collect();
        Some(Exchange::of_batches(batches?, self.counters, jobs))
    }
}
