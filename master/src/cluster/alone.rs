//! A master without workers goes on by itself: a solve that nobody works at would never end.

use std::sync::OnceLock;
use std::time::{Duration, Instant};

use nestrad_proto::v1;
use nestrad_worker::{Block, Tracer, trace_packed};
use prost::Message;

use super::Cluster;
use super::scheduler::Id;
use crate::exchange::{ExchangeError, JobRows};

/// How long nobody has been there.
#[derive(Default)]
pub(super) struct Alone {
    since: Option<Instant>,
}

impl Alone {
    /// Whether patience has come to its end. Asked for again and again.
    pub(super) fn for_too_long(&mut self, anybody: bool, patience: Duration) -> bool {
        if anybody {
            self.since = None;
            return false;
        }
        self.since.get_or_insert_with(Instant::now).elapsed() >= patience
    }
}

/// A block that the master itself computes jobs of.
pub(super) struct OwnBlock {
    number: usize,
    block: Block,
    tracer: OnceLock<Tracer>,
}

impl Cluster {
    /// Computes a job that waits; nothing where there is none, or where another was faster.
    pub(super) fn compute_one(
        &self,
        solve: Id,
        own: &mut Option<OwnBlock>,
    ) -> Result<Option<(usize, JobRows)>, ExchangeError> {
        let state = self.lock();
        let Some((job, number)) = state.scheduler.waiting(solve) else {
            return Ok(None);
        };
        let Some(open) = state.solves.get(&solve) else {
            return Ok(None);
        };
        let of = &open.jobs[job];
        let batch = of.message(&open.batches[of.batch as usize]);
        let bytes = open.blocks[number].bytes.clone();
        drop(state);
        if own.as_ref().is_none_or(|own| own.number != number) {
            let message = v1::Block::decode(bytes)
                .map_err(|error| ExchangeError::Failed(format!("block: {error}")))?;
            *own = Some(OwnBlock {
                number,
                block: Block::new(&message)?,
                tracer: OnceLock::new(),
            });
        }
        let Some(own) = own else { return Ok(None) };
        let rows = self.0.compute.install(|| {
            let tracer = || own.tracer.get_or_init(|| Tracer::new(&own.block));
            trace_packed(&own.block, tracer, &batch)
        });
        let first = self.lock().scheduler.known(solve, job);
        Ok(first.then(|| (job, rows.into())))
    }
}
