//! Workers as a source of rows.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use nestrad_engine::exchange::{
    ExchangeError, JobCounts, JobRows, Origin, Ready, RowSource, Sampling, SmallestWorker, Take,
    ThisProcess, Work, partition,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::run::Run;
use nestrad_engine::stop::Stop;
use nestrad_proto::near_field::batch_message;
use rayon::prelude::*;

use crate::audits::{Audits, Said};
use crate::blocks::SentBlock;
use crate::cluster::{Brought, Cluster, ClusterState, Open};
use crate::patience::Alone;
use crate::scheduler::{BlockSpec, Id, JobSpec, SolveEnd, WorkerFacts};

/// How long a thread sleeps before it looks whether it is still wanted.
const PATIENCE: Duration = Duration::from_millis(100);

impl ClusterState {
    /// Whether anything can be computed.
    fn check(&self) -> Result<(), ExchangeError> {
        let failed = self.failed.clone().map(ExchangeError::Failed);
        failed.map_or(Ok(()), Err)
    }
}

/// The workers of a cluster as the rows of one solve. Some jobs of theirs are computed again.
pub(crate) struct Workers<'a> {
    cluster: &'a Cluster,
    audits: Audits,
}

impl<'a> Workers<'a> {
    pub(crate) fn of(cluster: &'a Cluster) -> Self {
        let audits = Audits::new(cluster.0.limits.audit);
        Self { cluster, audits }
    }
}

impl RowSource for Workers<'_> {
    fn is_elsewhere(&self) -> bool {
        !self.audits.have_failed()
    }

    fn origin(&self, job: usize) -> Option<Origin> {
        self.audits.origin(job)
    }

    /// Waits for the first worker, which may come at any time.
    fn cut(&self, frame: &Frame, sampling: &Sampling, run: &Run) -> Result<Work, ExchangeError> {
        self.audits.begin();
        if self.audits.have_failed() {
            return ThisProcess::default().cut(frame, sampling, run);
        }
        run.progress.stage("waiting for a worker", 0);
        let worker = self.cluster.smallest_worker(run.stop)?;
        self.cluster.0.compute.install(|| {
            let blocks = partition(frame, sampling, worker)?;
            Ok(Work::split(frame, sampling, blocks))
        })
    }

    /// By the workers; where none comes in time, the master computes by itself.
    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        if self.audits.have_failed() {
            return ThisProcess::default().trace(frame, work, wanted, take, run);
        }
        let mut running = self.cluster.begin(frame, work, wanted)?;
        for _ in wanted {
            let next = running.next(run.stop);
            if let Err(ExchangeError::Distrusted { .. }) = &next {
                self.audits.failed();
            }
            let (job, rows, brought) = next?;
            if let Some(brought) = brought {
                self.audits.brought(job, brought);
                if self.audits.chooses(job) {
                    running.audit(&self.audits, job)?;
                }
            }
            self.cluster.0.compute.install(|| take(job, rows))?;
        }
        // everybody is audited once in a solve at least
        for job in self.audits.of_others() {
            run.stop.check()?;
            running.audit(&self.audits, job)?;
        }
        // found out in another solve
        let refused = self.cluster.lock().refused.clone();
        if let Some(worker) = self.audits.any_of(&refused) {
            self.audits.failed();
            return Err(distrusted(&worker));
        }
        Ok(JobCounts {
            traced: wanted.len() as u64,
            kept: 0,
        })
    }
}

impl Cluster {
    /// The least memory for each thread decides: a block is to fit every worker there is. Where none comes
    /// in time, it is the master that has to do.
    fn smallest_worker(&self, stop: &Stop) -> Result<SmallestWorker, ExchangeError> {
        let mut alone = Alone::default();
        let mut state = self.lock();
        loop {
            stop.check()?;
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
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Hands the wanted jobs to the scheduler.
    fn begin<'a>(
        &'a self,
        frame: &'a Frame,
        work: &'a Work,
        wanted: &[usize],
    ) -> Result<Running<'a>, ExchangeError> {
        let sent = self.0.compute.install(|| {
            let blocks = work.blocks.par_iter();
            let sent = blocks.map(|block| SentBlock::new(frame, block, &work.sampling));
            sent.collect::<Result<Vec<SentBlock>, ExchangeError>>()
        })?;
        let (sender, results) = mpsc::channel();
        let block_specs = sent.iter().map(|b| BlockSpec {
            id: b.id,
            demand: b.demand,
        });
        let job_specs = work.jobs.iter().map(|j| JobSpec {
            block: j.block,
            cost_s: j.cost_s,
        });
        let batches = (0..work.jobs.len()).map(|job| batch_message(&work.batch(job)));
        let batches = batches.collect();
        let mut state = self.lock();
        let id = state
            .scheduler
            .begin(block_specs.collect(), job_specs.collect());
        let mut wanted = wanted.iter().copied().peekable();
        for job in 0..work.jobs.len() {
            if wanted.next_if_eq(&job).is_none() {
                state.scheduler.known(id, job);
            }
        }
        let open = Open {
            blocks: sent,
            batches,
            costs_s: work.jobs.iter().map(|job| job.cost_s).collect(),
            scene: frame.block().clone(),
            parts: work.blocks.clone(),
            results: sender,
        };
        state.solves.insert(id, open);
        drop(state);
        self.0.changed.notify_waiters();
        Ok(Running {
            cluster: self,
            frame,
            work,
            id,
            results,
            alone: Alone::default(),
            own: None,
        })
    }
}

/// A solve in the hands of the scheduler, which lets go of it with this.
struct Running<'a> {
    cluster: &'a Cluster,
    frame: &'a Frame,
    work: &'a Work,
    id: Id,
    results: Receiver<Result<Brought, Arc<str>>>,
    alone: Alone,
    /// The block that the master itself computes jobs of.
    own: Option<(usize, Ready)>,
}

/// A job, its rows, and who brought them, where it was a worker.
type Next = (usize, JobRows, Option<Said>);

impl Running<'_> {
    /// The next result, whichever job it is of.
    fn next(&mut self, stop: &Stop) -> Result<Next, ExchangeError> {
        loop {
            // who computes by itself does not sleep
            let patience = self.own.as_ref().map_or(PATIENCE, |_| Duration::ZERO);
            match self.results.recv_timeout(patience) {
                Ok(Err(worker)) => return Err(distrusted(&worker)),
                Ok(Ok(brought)) => {
                    let Brought {
                        job,
                        rows,
                        worker,
                        checksum,
                    } = brought;
                    let counts = rows.counts();
                    let said = Said {
                        worker,
                        checksum,
                        counts,
                    };
                    return Ok((job, rows, Some(said)));
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(ExchangeError::Failed("the workers are gone".to_owned()));
                }
            }
            stop.check()?;
            let state = self.cluster.lock();
            state.check()?;
            let end = state.scheduler.end_of(self.id);
            if let Some(SolveEnd::Failed(reason)) = end {
                return Err(ExchangeError::Failed(reason));
            }
            let anybody = state.scheduler.has_worker_for(self.id);
            drop(state);
            let limit = self.cluster.0.limits.patience;
            if self.alone.for_too_long(anybody, limit) {
                if let Some((job, rows)) = self.compute_one()? {
                    return Ok((job, rows, None));
                }
            } else {
                self.own = None;
            }
        }
    }

    /// Computes a job that waits; nothing where there is none, or where another was faster.
    fn compute_one(&mut self) -> Result<Option<(usize, JobRows)>, ExchangeError> {
        let Some((job, number)) = self.cluster.lock().scheduler.waiting(self.id) else {
            return Ok(None);
        };
        let rows = self.compute(job, number)?;
        let first = self.cluster.lock().scheduler.known(self.id, job);
        Ok(first.then_some((job, rows)))
    }

    /// The rows of a job of a block, computed by the master.
    fn compute(&mut self, job: usize, number: usize) -> Result<JobRows, ExchangeError> {
        let own = match self.own.take().filter(|(of, _)| *of == number) {
            Some((_, ready)) => ready,
            None => Ready::of(&self.work.blocks[number], self.frame)?,
        };
        let rows = self.cluster.0.compute.install(|| own.rows(self.work, job));
        self.own = Some((number, own));
        Ok(rows)
    }

    /// Computes a job again; a worker that brought other rows is refused from now on.
    fn audit(&mut self, audits: &Audits, job: usize) -> Result<(), ExchangeError> {
        let rows = self.compute(job, self.work.jobs[job].block)?;
        let totals = &self.cluster.0.totals;
        totals.audited.fetch_add(1, Ordering::Relaxed);
        let Some(worker) = audits.compare(job, &rows) else {
            return Ok(());
        };
        self.cluster.refuse(&worker);
        Err(distrusted(&worker))
    }
}

fn distrusted(worker: &str) -> ExchangeError {
    ExchangeError::Distrusted {
        worker: worker.to_owned(),
    }
}

impl Drop for Running<'_> {
    fn drop(&mut self) {
        let mut state = self.cluster.lock();
        state.scheduler.end(self.id);
        state.solves.remove(&self.id);
    }
}
