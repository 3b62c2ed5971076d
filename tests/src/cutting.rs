//! The exchange, cut in other ways than the program does.

use nestrad_engine::exchange::{
    BlockOf, ExchangeError, JobCounts, JobOf, RowSource, Sampling, Take, ThisProcess, Work,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::run::Run;

/// This process, with a job for each of these blocks and each batch.
pub struct InBlocks(pub Vec<BlockOf>);

impl RowSource for InBlocks {
    fn cut(&self, frame: &Frame, sampling: &Sampling, _: &Run) -> Result<Work, ExchangeError> {
        let whole = Work::by_batch(frame, sampling);
        let of_batch = |job: &JobOf| {
            let job = job.clone();
            (0..self.0.len()).map(move |block| JobOf {
                block,
                ..job.clone()
            })
        };
        Ok(Work {
            blocks: self.0.clone().into(),
            jobs: whole.jobs.iter().flat_map(of_batch).collect(),
            ..whole
        })
    }

    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        ThisProcess::default().trace(frame, work, wanted, take, run)
    }
}
