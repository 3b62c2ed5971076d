//! The exchange of a solve, computed by workers.

use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

use bytes::Bytes;
use nestrad_common::scene::Scene;
use nestrad_proto::packed::Shape;
use nestrad_proto::v1;
use nestrad_worker::Demand;
use prost::Message;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::alone::{Alone, OwnBlock};
use super::scheduler::{BlockId, BlockSpec, Id, JobSpec, Outcome, WorkerFacts};
use super::{Cluster, State};
use crate::exchange::{
    Assembly, BlockOf, Exchange, ExchangeError, JobCounts, JobOf, JobRows, Sampling,
    SmallestWorker, batches, block_message, demand, partition, split,
};
use crate::output::progress::Progress;
use crate::store::{self, Key, Store};
use crate::world::World;

/// How long a thread sleeps before it looks whether it is still wanted.
const PATIENCE: Duration = Duration::from_millis(100);

/// A solve at which workers work.
pub(super) struct Open {
    pub(super) blocks: Arc<[SentBlock]>,
    pub(super) batches: Arc<[v1::Batch]>,
    pub(super) jobs: Arc<[JobOf]>,
    /// Number of ends of its world.
    pub(super) ends: u32,
    pub(super) results: Sender<(usize, JobRows)>,
}

/// A block as it is sent.
pub(super) struct SentBlock {
    pub(super) id: BlockId,
    /// The encoded message.
    pub(super) bytes: Bytes,
    pub(super) rows: u32,
    pub(super) demand: Demand,
}

impl SentBlock {
    fn new(scene: &Scene, world: &World, block: &BlockOf, sampling: &Sampling) -> Self {
        let bytes = block_message(scene, world, block).encode_to_vec();
        let demand = demand(world, block, sampling);
        Self {
            id: *blake3::hash(&bytes).as_bytes(),
            bytes: bytes.into(),
            rows: demand.rows as u32,
            demand,
        }
    }
}

/// A solve, cut for its workers.
struct Cut {
    of: Vec<BlockOf>,
    sent: Vec<SentBlock>,
    batches: Vec<v1::Batch>,
    jobs: Arc<[JobOf]>,
    /// Names of the jobs' results, where these are kept.
    keys: Vec<Key>,
}

impl Cut {
    fn new(
        (scene, world, sampling): (&Scene, &World, &Sampling),
        worker: SmallestWorker,
        kept: bool,
        pool: &ThreadPool,
    ) -> Result<Self, ExchangeError> {
        pool.install(|| {
            let of = partition(scene, world, sampling, worker)?;
            let batches = batches(sampling);
            let jobs = split(world, &of, &batches, sampling);
            let sent: Vec<SentBlock> = of
                .par_iter()
                .map(|block| SentBlock::new(scene, world, block, sampling))
                .collect();
            let key = |job: &JobOf| {
                let batch = job.message(&batches[job.batch as usize]);
                store::key(&sent[job.block].id, &batch)
            };
            let keys = jobs.iter().filter(|_| kept).map(key).collect();
            Ok(Self {
                of,
                jobs: jobs.into(),
                keys,
                sent,
                batches,
            })
        })
    }

    /// The shape of a job's rows.
    fn shape(&self, job: usize, world: &World) -> Shape {
        Shape {
            rows: self.sent[self.jobs[job].block].rows,
            ends: world.ends.len() as u32,
        }
    }
}

impl State {
    /// Whether anything can be computed.
    fn check(&self) -> Result<(), ExchangeError> {
        let failed = self.failed.clone().map(ExchangeError::Failed);
        failed.map_or(Ok(()), Err)
    }
}

impl Cluster {
    /// Has all batches traced by the workers, but for what is kept from before. Waits for the first of them,
    /// which may come at any time; where none comes in time, the master computes by itself.
    pub fn trace(
        &self,
        scene: &Scene,
        world: &World,
        sampling: &Sampling,
        kept: Option<&Store>,
        progress: &Progress,
    ) -> Result<Exchange, ExchangeError> {
        if let Some(kept) = kept
            && !self.has_workers()
            && let Some(exchange) = self.all_kept((scene, world, sampling), kept, progress)?
        {
            return Ok(exchange);
        }
        progress.stage("waiting for a worker", 0);
        let worker = self.smallest_worker(progress)?;
        let cut = Cut::new(
            (scene, world, sampling),
            worker,
            kept.is_some(),
            &self.0.compute,
        )?;
        let jobs = cut.jobs.clone();
        let mut assembly = Assembly::new(world, &cut.of, jobs.clone(), sampling.batches);
        progress.stage("exchange", jobs.len() as u64);
        let mut known = Vec::new();
        if let Some(kept) = kept {
            for (number, key) in cut.keys.iter().enumerate() {
                if let Some(rows) = kept.get(key, cut.shape(number, world)) {
                    self.0.compute.install(|| assembly.put(number, rows))?;
                    progress.inc(1);
                    known.push(number);
                }
            }
        }
        let counts = JobCounts {
            traced: (jobs.len() - known.len()) as u64,
            kept: known.len() as u64,
        };
        let Cut {
            sent,
            batches,
            keys,
            ..
        } = cut;
        let mut running = self.begin(sent, batches, jobs, &known, world);
        for _ in 0..counts.traced {
            let (job, rows) = running.next(progress)?;
            if let Some(kept) = kept {
                kept.put(keys[job], &rows);
            }
            self.0.compute.install(|| assembly.put(job, rows))?;
            progress.inc(1);
        }
        drop(running);
        let exchange = self.0.compute.install(|| assembly.finish(counts));
        exchange.ok_or_else(|| ExchangeError::Failed("jobs without result".to_owned()))
    }

    /// The exchange, where all jobs of the scene as one block are kept: then nobody needs to come.
    fn all_kept(
        &self,
        (scene, world, sampling): (&Scene, &World, &Sampling),
        kept: &Store,
        progress: &Progress,
    ) -> Result<Option<Exchange>, ExchangeError> {
        let whole = SmallestWorker {
            memory_bytes: u64::MAX,
            threads: 1,
        };
        let cut = Cut::new((scene, world, sampling), whole, true, &self.0.compute)?;
        if !cut.keys.iter().all(|key| kept.has(key)) {
            return Ok(None);
        }
        progress.stage("exchange", cut.jobs.len() as u64);
        let mut assembly = Assembly::new(world, &cut.of, cut.jobs.clone(), sampling.batches);
        for (number, key) in cut.keys.iter().enumerate() {
            progress.check()?;
            let Some(rows) = kept.get(key, cut.shape(number, world)) else {
                return Ok(None);
            };
            self.0.compute.install(|| assembly.put(number, rows))?;
            progress.inc(1);
        }
        let counts = JobCounts {
            traced: 0,
            kept: cut.jobs.len() as u64,
        };
        Ok(self.0.compute.install(|| assembly.finish(counts)))
    }

    /// The least memory for each thread decides: a block is to fit every worker there is. Where none comes
    /// in time, it is the master that has to do.
    fn smallest_worker(&self, progress: &Progress) -> Result<SmallestWorker, ExchangeError> {
        let mut alone = Alone::default();
        let mut state = self.lock();
        loop {
            progress.check()?;
            state.check()?;
            let of = |facts: &WorkerFacts| SmallestWorker {
                memory_bytes: facts.memory_bytes,
                threads: facts.threads,
            };
            let smallest = state
                .scheduler
                .facts()
                .map(of)
                .min_by_key(|w| (w.memory_bytes / u64::from(w.threads.max(1)), w.threads));
            if let Some(smallest) = smallest {
                return Ok(smallest);
            }
            if alone.for_too_long(false, self.0.limits.patience) {
                return Ok(SmallestWorker {
                    memory_bytes: u64::MAX,
                    threads: 1,
                });
            }
            let waited = self.0.joined.wait_timeout(state, PATIENCE);
            state = waited.unwrap_or_else(std::sync::PoisonError::into_inner).0;
        }
    }

    fn begin(
        &self,
        blocks: Vec<SentBlock>,
        batches: Vec<v1::Batch>,
        jobs: Arc<[JobOf]>,
        known: &[usize],
        world: &World,
    ) -> Running<'_> {
        let (sender, results) = mpsc::channel();
        let block_specs = blocks.iter().map(|b| BlockSpec {
            id: b.id,
            demand: b.demand,
        });
        let job_specs = jobs.iter().map(|j| JobSpec {
            block: j.block,
            cost_s: j.cost_s,
        });
        let mut state = self.lock();
        let id = state
            .scheduler
            .begin(block_specs.collect(), job_specs.collect());
        for &job in known {
            state.scheduler.known(id, job);
        }
        let open = Open {
            blocks: blocks.into(),
            batches: batches.into(),
            jobs,
            ends: world.ends.len() as u32,
            results: sender,
        };
        state.solves.insert(id, open);
        drop(state);
        self.0.changed.notify_waiters();
        Running {
            cluster: self,
            id,
            results,
            alone: Alone::default(),
            own: None,
        }
    }
}

/// A solve in the hands of the scheduler, which lets go of it with this.
struct Running<'a> {
    cluster: &'a Cluster,
    id: Id,
    results: Receiver<(usize, JobRows)>,
    alone: Alone,
    own: Option<OwnBlock>,
}

impl Running<'_> {
    /// The next result, whichever job it is of.
    fn next(&mut self, progress: &Progress) -> Result<(usize, JobRows), ExchangeError> {
        loop {
            // who computes by itself does not sleep
            let patience = self.own.as_ref().map_or(PATIENCE, |_| Duration::ZERO);
            match self.results.recv_timeout(patience) {
                Ok(result) => return Ok(result),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(ExchangeError::Failed("the workers are gone".to_owned()));
                }
            }
            progress.check()?;
            let state = self.cluster.lock();
            state.check()?;
            let outcome = state.scheduler.outcome(self.id);
            if let Some(Outcome::Failed(reason)) = outcome {
                return Err(ExchangeError::Failed(reason));
            }
            let anybody = state.scheduler.has_worker_for(self.id);
            drop(state);
            let limit = self.cluster.0.limits.patience;
            if self.alone.for_too_long(anybody, limit) {
                let computed = self.cluster.compute_one(self.id, &mut self.own)?;
                if let Some(result) = computed {
                    return Ok(result);
                }
            } else {
                self.own = None;
            }
        }
    }
}

impl Drop for Running<'_> {
    fn drop(&mut self) {
        let mut state = self.cluster.lock();
        state.scheduler.end(self.id);
        state.solves.remove(&self.id);
    }
}
