//! Rows that are kept from earlier solves, before those of another source.

use std::sync::Arc;

use nestrad_engine::exchange::{
    BlockOf, ExchangeError, JobCounts, JobRows, RowSource, Sampling, Take, Work,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::run::Run;
use nestrad_kernel::PackedRows;
use nestrad_kernel::expected::OfBlock;
use nestrad_proto::near_field::batch_message;
use prost::Message;

use crate::blocks::encoded;
use crate::store::{Key, Store};

/// What a store has, and for the rest another source, whose rows are kept.
pub struct Kept<'a> {
    store: &'a Store,
    rows: &'a dyn RowSource,
}

impl<'a> Kept<'a> {
    /// Kept rows before those of a source.
    pub fn before(rows: &'a dyn RowSource, store: &'a Store) -> Self {
        Self { store, rows }
    }
}

impl RowSource for Kept<'_> {
    fn is_elsewhere(&self) -> bool {
        self.rows.is_elsewhere()
    }

    /// The scene as one block where all of its jobs are kept: then nobody needs to come.
    fn cut(&self, frame: &Frame, sampling: &Sampling, run: &Run) -> Result<Work, ExchangeError> {
        let mut whole = Work::split(frame, sampling, vec![BlockOf::whole(frame)]);
        whole.names = names(frame, &whole)?;
        if whole.names.iter().all(|name| self.store.has(name)) {
            return Ok(whole);
        }
        let mut work = self.rows.cut(frame, sampling, run)?;
        // whoever does not cut for others can do jobs of any size, which serve others
        if !work.packed || work.blocks == whole.blocks {
            return Ok(whole);
        }
        work.names = names(frame, &work)?;
        Ok(work)
    }

    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        let blocks = work.blocks.iter();
        let known: Vec<Arc<OfBlock>> = blocks
            .map(|block| Arc::new(OfBlock::new(frame.block(), &block.owned())))
            .collect();
        let mut missing = Vec::new();
        for &job in wanted {
            run.stop.check()?;
            let block = work.jobs[job].block;
            let is_right = |rows: &PackedRows| {
                let (scene, owned) = (frame.block(), work.blocks[block].owned());
                let expected = known[block].job(scene, &owned, &work.batch(job), &rows.counts);
                expected
                    .and_then(|expected| expected.check(&rows.packed))
                    .is_ok()
            };
            match self.store.get(&work.names[job]).filter(is_right) {
                Some(rows) => take(job, JobRows::Packed(rows.into()))?,
                None => missing.push(job),
            }
        }
        let kept = (wanted.len() - missing.len()) as u64;
        if missing.is_empty() {
            return Ok(JobCounts { traced: 0, kept });
        }
        let mut not_audited = Vec::new();
        let mut keep = |job: usize, rows: JobRows| {
            if let JobRows::Packed(packed) = &rows {
                let origin = self.rows.origin(job);
                if origin.as_ref().is_some_and(|origin| !origin.audited) {
                    not_audited.push(job);
                }
                self.store.put(work.names[job], packed, origin);
            }
            take(job, rows)
        };
        let traced = self.rows.trace(frame, work, &missing, &mut keep, run);
        if let Err(ExchangeError::Distrusted { worker }) = &traced {
            self.store.drop_of(worker);
        }
        let traced = traced?;
        let audited = |job: &usize| self.rows.origin(*job).is_some_and(|of| of.audited);
        for job in not_audited.into_iter().filter(audited) {
            self.store.audited(work.names[job]);
        }
        Ok(JobCounts {
            kept: kept + traced.kept,
            ..traced
        })
    }
}

/// Names the results of all jobs by what they are made from: the kernel, the block's geometry, the job's lines and
/// rays. Where they are traced makes no difference.
fn names(frame: &Frame, work: &Work) -> Result<Vec<Key>, ExchangeError> {
    let blocks = work.blocks.iter().map(|block| {
        let bytes = encoded(frame, block)?;
        Ok(*blake3::hash(&bytes).as_bytes())
    });
    let blocks = blocks.collect::<Result<Vec<[u8; 32]>, ExchangeError>>()?;
    let name = |job: usize| {
        let mut hasher = blake3::Hasher::new();
        let kernel = nestrad_kernel::kernel().as_bytes();
        hasher.update(&(kernel.len() as u64).to_le_bytes());
        hasher.update(kernel);
        hasher.update(&blocks[work.jobs[job].block]);
        hasher.update(&batch_message(&work.batch(job)).encode_to_vec());
        *hasher.finalize().as_bytes()
    };
    Ok((0..work.jobs.len()).map(name).collect())
}
