//! Workers as a source of rows.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use nestrad_engine::exchange::{
    BlockOf, ExchangeError, JobCounts, JobRows, Origin, Ready, RowSource, Sampling, SmallestWorker,
    Take, ThisProcess, Work, partition,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::run::Run;
use nestrad_engine::stop::Stop;
use nestrad_proto::near_field::batch_message;
use rayon::prelude::*;

use crate::audits::{Audits, Said};
use crate::blocks::SentBlock;
use crate::cluster::{Brought, Cluster, Open};
use crate::patience::Patience;
use crate::scheduler::{BlockSpec, Id, JobSpec, WorkerFacts};

/// How long a thread sleeps before it looks whether it is still wanted.
const PAUSE: Duration = Duration::from_millis(100);

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
        !self.audits.have_failed() && !self.cluster.lock().alone
    }

    fn origin(&self, job: usize) -> Option<Origin> {
        self.audits.origin(job)
    }

    /// Waits for the first worker, which may come at any time. Blocks fit every worker that is large enough for the
    /// smallest of them; where none is, and where nobody comes, it is the master that has to do.
    fn cut(&self, frame: &Frame, sampling: &Sampling, run: &Run) -> Result<Work, ExchangeError> {
        self.audits.begin();
        if !self.is_elsewhere() {
            return ThisProcess::default().cut(frame, sampling, run);
        }
        run.progress.stage("waiting for a worker", 0);
        let sizes = self.cluster.sizes(run.stop)?;
        self.cluster.0.compute.install(|| {
            let blocks = blocks(frame, sampling, &sizes)?;
            Ok(Work::split(frame, sampling, blocks))
        })
    }

    /// By the workers; the master computes what they do not bring in time.
    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        if !self.is_elsewhere() {
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

/// Blocks for the smallest worker for which there are any: by halves, since a cut that fails takes as long as one
/// that does not. Without such a worker, the whole scene.
fn blocks(
    frame: &Frame,
    sampling: &Sampling,
    sizes: &[SmallestWorker],
) -> Result<Vec<BlockOf>, ExchangeError> {
    let (mut found, mut low, mut high) = (None, 0, sizes.len());
    while low < high {
        let middle = (low + high) / 2;
        match partition(frame, sampling, sizes[middle]) {
            Ok(blocks) => (found, high) = (Some(blocks), middle),
            Err(ExchangeError::BlockTooLarge { .. }) => low = middle + 1,
            Err(error) => return Err(error),
        }
    }
    Ok(found.unwrap_or_else(|| vec![BlockOf::whole(frame)]))
}

impl Cluster {
    /// Sizes of the workers that are there, each once, those with the least memory for each thread first. None where
    /// nobody comes in time.
    fn sizes(&self, stop: &Stop) -> Result<Vec<SmallestWorker>, ExchangeError> {
        let of = |facts: &WorkerFacts| SmallestWorker {
            memory_bytes: facts.memory_bytes,
            threads: facts.threads,
        };
        let mut state = self.lock();
        loop {
            stop.check()?;
            let mut sizes: Vec<SmallestWorker> = state.scheduler.facts().map(of).collect();
            let alone = state.scheduler.deserted_for(self.now());
            let is_over = alone.is_some_and(|time| time >= self.0.limits.patience);
            if !sizes.is_empty() || is_over || state.deserted {
                let least = |w: &SmallestWorker| {
                    let each = w.memory_bytes / u64::from(w.threads.max(1));
                    (each, w.threads, w.memory_bytes)
                };
                sizes.sort_unstable_by_key(least);
                sizes.dedup();
                return Ok(sizes);
            }
            let waited = self.0.joined.wait_timeout(state, PAUSE);
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
            patience: Patience::new(self.0.limits.patience),
            own: None,
            computed: VecDeque::new(),
            has_nothing: false,
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
    patience: Patience,
    /// The block that the master itself computes jobs of.
    own: Option<(usize, Ready)>,
    /// What it has computed, and not handed on yet.
    computed: VecDeque<(usize, JobRows)>,
    /// It looked for something to compute, and found nothing.
    has_nothing: bool,
}

/// A job, its rows, and who brought them, where it was a worker.
type Next = (usize, JobRows, Option<Said>);

impl Running<'_> {
    /// The next result, whichever job it is of.
    fn next(&mut self, stop: &Stop) -> Result<Next, ExchangeError> {
        loop {
            if let Some((job, rows)) = self.computed.pop_front() {
                return Ok((job, rows, None));
            }
            // who computes by itself does not sleep
            let is_busy = self.patience.is_over() && !self.has_nothing;
            let pause = if is_busy { Duration::ZERO } else { PAUSE };
            match self.results.recv_timeout(pause) {
                Ok(Err(worker)) => return Err(distrusted(&worker)),
                Ok(Ok(brought)) => {
                    let Brought {
                        job,
                        rows,
                        worker,
                        checksum,
                    } = brought;
                    self.patience.is_rewarded(self.work.jobs[job].cost_s);
                    let counts = rows.counts();
                    let said = Said {
                        worker,
                        checksum,
                        counts,
                    };
                    return Ok((job, rows, Some(said)));
                }
                Err(RecvTimeoutError::Timeout) => self.waited(pause),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(ExchangeError::Failed("the workers are gone".to_owned()));
                }
            }
            stop.check()?;
            self.has_nothing = true;
            if let Some((job, reason)) = self.failing() {
                self.compute(&[job], Some(&reason))?;
            } else if self.is_alone() {
                let most = self.cluster.0.compute.current_num_threads();
                let now = self.cluster.now();
                let jobs = {
                    let state = self.cluster.lock();
                    state.scheduler.for_the_master(now, self.id, most)
                };
                self.compute(&jobs, None)?;
            } else {
                self.own = None;
            }
        }
    }

    fn waited(&mut self, pause: Duration) {
        let was_over = self.patience.is_over();
        self.patience.waited(pause);
        if self.patience.is_over() && !was_over && self.cluster.has_workers() {
            let limit_s = self.cluster.0.limits.patience.as_secs_f64();
            let remark = format!(
                "workers brought next to nothing for {limit_s} s: the master computes too, until they bring more"
            );
            self.cluster.lock().remark(remark);
        }
    }

    /// A job that workers fail, and why.
    fn failing(&self) -> Option<(usize, String)> {
        let mut state = self.cluster.lock();
        let (job, reason) = state.scheduler.failing(self.id)?;
        let reason = reason.to_owned();
        state.remark(format!(
            "a near-field job failed on {reason}: the master computes it"
        ));
        Some((job, reason))
    }

    /// Whether the master is to compute by itself: nobody has been there for long, nobody who is there is large
    /// enough, or nothing comes of them.
    fn is_alone(&mut self) -> bool {
        let state = self.cluster.lock();
        if !state.scheduler.has_worker_for(self.id) {
            let alone = state.scheduler.deserted_for(self.cluster.now());
            let waits = alone.is_some_and(|time| time < self.cluster.0.limits.patience);
            if !waits || state.deserted {
                self.patience.ends();
            }
        }
        self.patience.is_over()
    }

    /// Computes jobs of one block, all at once; `reason` is why workers failed to. A panic is a fault of the kernel
    /// with that job.
    fn compute(&mut self, jobs: &[usize], reason: Option<&str>) -> Result<(), ExchangeError> {
        let rows = self.rows(jobs, reason)?;
        let mut state = self.cluster.lock();
        for (&job, rows) in jobs.iter().zip(rows) {
            // another may have been faster
            if state.scheduler.known(self.id, job) {
                self.computed.push_back((job, rows));
            }
        }
        self.has_nothing = false;
        Ok(())
    }

    /// The rows of jobs of one block.
    fn rows(
        &mut self,
        jobs: &[usize],
        reason: Option<&str>,
    ) -> Result<Vec<JobRows>, ExchangeError> {
        let Some(&first) = jobs.first() else {
            return Ok(Vec::new());
        };
        let number = self.work.jobs[first].block;
        let own = match self.own.take().filter(|(of, _)| *of == number) {
            Some((_, ready)) => ready,
            None => Ready::of(&self.work.blocks[number], self.frame)?,
        };
        let work = self.work;
        let rows = |&job: &usize| {
            let rows = catch_unwind(AssertUnwindSafe(|| own.rows(work, job)));
            rows.map_err(|_| {
                let before = reason.map(|reason| format!("on {reason}; and "));
                let before = before.unwrap_or_default();
                let text = format!("near-field job {job} failed {before}in the master");
                ExchangeError::Failed(text)
            })
        };
        let all: Result<Vec<JobRows>, ExchangeError> =
            (self.cluster.0.compute).install(|| jobs.par_iter().map(rows).collect());
        self.own = Some((number, own));
        all
    }

    /// Computes a job again; a worker that brought other rows is refused from now on.
    fn audit(&mut self, audits: &Audits, job: usize) -> Result<(), ExchangeError> {
        let rows = self.rows(&[job], None)?;
        let totals = &self.cluster.0.totals;
        totals.audited.fetch_add(1, Ordering::Relaxed);
        let wrong = rows.first().and_then(|rows| audits.compare(job, rows));
        let Some(worker) = wrong else {
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
