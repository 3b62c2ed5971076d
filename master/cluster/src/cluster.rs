//! The workers of a master, and what they work at.

use std::collections::HashMap;
use std::fmt;
use std::hash::{BuildHasher, RandomState};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

use nestrad_engine::exchange::{BlockOf, JobRows};
use nestrad_kernel::Block;
use nestrad_proto::v1;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use tokio::sync::Notify;

use crate::blocks::SentBlock;
use crate::room::Room;
use crate::scheduler::{Id, Rules, Scheduler, SolveCounts, Time, WorkerCounts};
use crate::sending::Turns;

/// What a master allows its workers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorkerLimits {
    /// Times and counts of the scheduler.
    pub rules: Rules,
    /// How often a worker is to be heard of.
    pub heartbeat: Duration,
    /// Bytes of results that are on their way in at a time; no single result is larger than half of it.
    pub result_bytes: u32,
    /// Workers at a time.
    pub workers: usize,
    /// Without any worker, or without progress of those that are there, for so long, the master computes by itself.
    pub patience: Duration,
    /// The share of the workers' jobs that the master computes again, 0 to 1.
    pub audit: f64,
}

impl Default for WorkerLimits {
    fn default() -> Self {
        let rules = Rules::default();
        Self {
            heartbeat: rules.lease / 6,
            rules,
            result_bytes: 1 << 30,
            workers: 4096,
            patience: Duration::from_secs(60),
            audit: 0.01,
        }
    }
}

impl WorkerLimits {
    /// These limits with another lease time, and heartbeats to fit.
    #[must_use]
    pub fn with_lease(mut self, lease: Duration) -> Self {
        self.rules.lease = lease;
        self.heartbeat = lease / 6;
        self
    }
}

/// The workers of a master, and what they work at. Clones are the same cluster.
#[derive(Clone)]
pub struct Cluster(pub(crate) Arc<Shared>);

pub(crate) struct Shared {
    pub(crate) limits: WorkerLimits,
    pub(crate) begun: Instant,
    pub(crate) state: Mutex<ClusterState>,
    /// There may be something to lease.
    pub(crate) changed: Notify,
    /// A worker has joined.
    pub(crate) joined: Condvar,
    /// For results that come in.
    pub(crate) room: Room,
    /// Who is sent a block now.
    pub(crate) turns: Turns,
    /// Where rows are checked and joined.
    pub(crate) compute: ThreadPool,
    pub(crate) totals: Totals,
    /// Chooses what workers must not foretell.
    pub(crate) key: RandomState,
}

pub(crate) struct ClusterState {
    pub(crate) scheduler: Scheduler,
    pub(crate) solves: HashMap<Id, Open>,
    /// Workers are told to leave.
    pub(crate) draining: bool,
    /// Workers are told to come back later.
    pub(crate) closed: bool,
    /// No worker will come any more.
    pub(crate) deserted: bool,
    /// What the user may want to know, each once.
    pub(crate) remarks: Vec<String>,
    /// The master computes by itself: there is no room for workers.
    pub(crate) alone: bool,
    /// Workers that returned wrong rows.
    pub(crate) refused: Vec<Arc<str>>,
}

/// A solve at which workers work.
pub(crate) struct Open {
    pub(crate) blocks: Vec<SentBlock>,
    /// What the kernel is asked for each job.
    pub(crate) batches: Vec<v1::Batch>,
    /// What each job is expected to take, seconds.
    pub(crate) costs_s: Vec<f64>,
    /// The whole scene, and what of it each block holds.
    pub(crate) scene: Block,
    pub(crate) parts: Arc<[BlockOf]>,
    /// Rows that are right as far as can be seen, and workers whose rows are not.
    pub(crate) results: Sender<Result<Brought, Arc<str>>>,
}

/// Rows that a worker brought.
pub(crate) struct Brought {
    pub(crate) job: usize,
    pub(crate) rows: JobRows,
    /// Who brought them.
    pub(crate) worker: Arc<str>,
    /// BLAKE3 of the packed rows.
    pub(crate) checksum: [u8; 32],
}

/// What has been done since the start.
#[derive(Debug, Default)]
pub(crate) struct Totals {
    pub(crate) bytes_in: AtomicU64,
    pub(crate) bytes_out: AtomicU64,
    pub(crate) results: AtomicU64,
    pub(crate) refused: AtomicU64,
    pub(crate) segments: AtomicU64,
    pub(crate) rays: AtomicU64,
    pub(crate) audited: AtomicU64,
}

/// The state of a cluster at one moment.
#[derive(Clone, Debug, Default)]
pub struct ClusterStatus {
    /// Every worker that is known.
    pub workers: Vec<WorkerCounts>,
    /// Jobs of all solves together.
    pub jobs: SolveCounts,
    /// What those jobs that are not done should take, seconds on one thread.
    pub left_s: f64,
    /// Bytes of rows that came in, and of blocks that went out, since the start.
    pub bytes_in: u64,
    /// See `bytes_in`.
    pub bytes_out: u64,
    /// Results that were taken, and that were refused.
    pub results: u64,
    /// See `results`.
    pub refused: u64,
    /// Leases that were lost or failed.
    pub lost: u64,
    /// Segments and rays of all results.
    pub segments: u64,
    /// See `segments`.
    pub rays: u64,
    /// Jobs of workers that the master computed again.
    pub audited: u64,
    /// Workers that returned wrong rows, and are refused.
    pub untrusted: Vec<Arc<str>>,
}

impl ClusterStatus {
    /// Seconds until all jobs are done, going by what those that are done took; `None` without jobs or
    /// workers.
    pub fn eta_s(&self) -> Option<f64> {
        let threads: u32 = self.workers.iter().map(|w| w.facts.threads).sum();
        let known = threads > 0 && self.jobs.waiting + self.jobs.leased > 0;
        known.then(|| self.left_s / f64::from(threads))
    }
}

impl fmt::Debug for Cluster {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Cluster").field(&self.status()).finish()
    }
}

impl Cluster {
    /// A cluster without workers, that checks and joins rows on so many threads, 0 for one per
    /// processor. Somebody is to [keep watch](Self::keep_watch) over it.
    pub fn new(limits: WorkerLimits, threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let compute = ThreadPoolBuilder::new().num_threads(threads).build()?;
        // what a master before this one gave out is not to be taken for this one's
        let first_id = RandomState::new().hash_one(Instant::now()) >> 1;
        let shared = Arc::new(Shared {
            begun: Instant::now(),
            state: Mutex::new(ClusterState {
                scheduler: Scheduler::new(limits.rules, first_id),
                solves: HashMap::new(),
                draining: false,
                closed: false,
                deserted: false,
                remarks: Vec::new(),
                alone: false,
                refused: Vec::new(),
            }),
            changed: Notify::new(),
            joined: Condvar::new(),
            turns: Turns::new(),
            room: Room::new(u64::from(limits.result_bytes)),
            compute,
            totals: Totals::default(),
            key: RandomState::new(),
            limits,
        });
        Ok(Self(shared))
    }

    /// Takes back what is overdue, for as long as there is a cluster.
    pub fn keep_watch(&self) -> impl Future<Output = ()> + Send + use<> {
        watch(Arc::downgrade(&self.0))
    }

    /// Tells all workers to leave as soon as they ask for a job.
    pub fn drain(&self) {
        self.lock().draining = true;
        self.0.changed.notify_waiters();
    }

    /// Gives out no more jobs: workers that ask are to ask again later, when there may be another master.
    pub fn close(&self) {
        self.lock().closed = true;
        self.0.changed.notify_waiters();
    }

    /// There are no workers any more, and there will be none: the master computes by itself.
    pub fn desert(&self, reason: &str) {
        let now = self.now();
        let mut state = self.lock();
        state.deserted = true;
        state.scheduler.all_leave(now);
        state.remark(format!("{reason}: the master computes by itself"));
        drop(state);
        self.0.joined.notify_all();
    }

    /// What the user may want to know of the workers, each thing once.
    pub fn remarks(&self) -> Vec<String> {
        self.lock().remarks.clone()
    }

    /// Says whether the master is to compute by itself from now on, or workers for it.
    pub fn set_alone(&self, alone: bool) {
        self.lock().alone = alone;
    }

    /// Whether anybody is there to compute.
    pub fn has_workers(&self) -> bool {
        self.lock().scheduler.facts().next().is_some()
    }

    /// How it stands.
    pub fn status(&self) -> ClusterStatus {
        let now = self.now();
        let state = self.lock();
        let workers = state.scheduler.workers(now);
        let mut jobs = SolveCounts::default();
        for solve in state.solves.keys() {
            jobs += state.scheduler.counts(*solve).unwrap_or_default();
        }
        let totals = &self.0.totals;
        let of = |total: &AtomicU64| total.load(Ordering::Relaxed);
        ClusterStatus {
            workers,
            jobs,
            left_s: state.scheduler.left_s(),
            bytes_in: of(&totals.bytes_in),
            bytes_out: of(&totals.bytes_out),
            results: of(&totals.results),
            refused: of(&totals.refused),
            lost: state.scheduler.lost(),
            segments: of(&totals.segments),
            rays: of(&totals.rays),
            audited: of(&totals.audited),
            untrusted: state.refused.clone(),
        }
    }

    /// A worker returned wrong rows: from now on it is turned away.
    pub(crate) fn refuse(&self, worker: &Arc<str>) {
        tracing::error!(%worker, "returned wrong rows and is refused from now on; all rows of this solve are computed anew");
        let mut state = self.lock();
        state.scheduler.dismiss(self.now(), worker);
        if !state.refused.contains(worker) {
            if state.refused.len() >= MOST_REFUSED {
                state.refused.remove(0);
            }
            state.refused.push(worker.clone());
        }
        drop(state);
        self.0.changed.notify_waiters();
    }

    pub(crate) fn now(&self) -> Time {
        self.0.begun.elapsed()
    }

    pub(crate) fn lock(&self) -> MutexGuard<'_, ClusterState> {
        // the state is whole between any two calls of the scheduler
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Workers that are remembered as refused: the last ones.
const MOST_REFUSED: usize = 4096;

/// Remarks that are kept.
const MOST_REMARKS: usize = 100;

impl ClusterState {
    /// Notes what the user may want to know; once, however often it is so.
    pub(crate) fn remark(&mut self, remark: String) {
        if self.remarks.len() < MOST_REMARKS && !self.remarks.contains(&remark) {
            tracing::warn!("{remark}");
            self.remarks.push(remark);
        }
    }
}

/// How often it is looked whether leases are overdue, or jobs take too long.
const TICK: Duration = Duration::from_millis(100);

async fn watch(cluster: Weak<Shared>) {
    let mut tick = tokio::time::interval(TICK);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    loop {
        tick.tick().await;
        let Some(shared) = cluster.upgrade() else {
            return;
        };
        let cluster = Cluster(shared);
        let now = cluster.now();
        cluster.lock().scheduler.expire(now);
        cluster.0.changed.notify_waiters();
    }
}
