//! The solves that the master knows: those that wait, those that are computed, and what came of the
//! others. Of bounded number and size; of what has ended, the oldest goes first.

mod solver;

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use nestrad_proto::v1;
use tokio::sync::watch;

use super::error::{ErrorCode, ServiceError};
use super::identity::{Id, solve_id};
use super::scenes::HeldScene;
use super::solution::HeldSolution;
use nestrad_engine::plan::Settings;
use nestrad_engine::progress::Progress;
use nestrad_engine::stop::Stop;
use nestrad_engine::traced::FailureKind;

pub(super) use solver::Solver;

/// Solves that have ended and are kept, however small their results.
const MAX_ENDED: usize = 256;

/// Nobody has come for a result after this.
const KEPT: Duration = Duration::from_secs(24 * 3600);

/// A client that fetches one table after the other pauses no longer.
const BETWEEN_TABLES: Duration = Duration::from_secs(1);

/// Where a solve is.
#[derive(Clone, Debug)]
pub(super) enum Phase {
    Queued,
    Running,
    Finished(Arc<HeldSolution>),
    Failed(FailureKind, String),
    Cancelled,
}

impl Phase {
    pub(super) fn has_ended(&self) -> bool {
        !matches!(self, Self::Queued | Self::Running)
    }

    pub(super) fn message(&self) -> v1::SolveState {
        match self {
            Self::Queued => v1::SolveState::Queued,
            Self::Running => v1::SolveState::Running,
            Self::Finished(_) => v1::SolveState::Finished,
            Self::Failed(..) => v1::SolveState::Failed,
            Self::Cancelled => v1::SolveState::Cancelled,
        }
    }

    fn bytes(&self) -> u64 {
        match self {
            Self::Finished(outcome) => outcome.bytes(),
            _ => 0,
        }
    }
}

/// A solve from its start until it is forgotten.
#[derive(Debug)]
pub(super) struct Solve {
    pub(super) id: Id,
    pub(super) scene_id: Id,
    pub(super) triangles: u64,
    pub(super) bands: u32,
    pub(super) settings: Settings,
    pub(super) progress: Progress,
    pub(super) stop: Stop,
    /// Taken by the thread that computes it, so that a solve that has ended holds no scene.
    scene: Mutex<Option<HeldScene>>,
    phase: watch::Sender<Phase>,
    plan: Mutex<Vec<String>>,
    queued: Instant,
    times: Mutex<Times>,
    /// When somebody last took something of its results.
    fetched: Mutex<Option<Instant>>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Times {
    begun: Option<Instant>,
    ended: Option<Instant>,
}

impl Solve {
    pub(super) fn phase(&self) -> Phase {
        self.phase.borrow().clone()
    }

    /// To be told of every change of state.
    pub(super) fn watch(&self) -> watch::Receiver<Phase> {
        self.phase.subscribe()
    }

    pub(super) fn plan(&self) -> Vec<String> {
        lock(&self.plan).clone()
    }

    pub(super) fn set_plan(&self, lines: &[String]) {
        *lock(&self.plan) = lines.to_vec();
    }

    pub(super) fn take_scene(&self) -> Option<HeldScene> {
        lock(&self.scene).take()
    }

    /// Where it ended, what came of it.
    fn end(&self, state: Phase) {
        lock(&self.times).ended = Some(Instant::now());
        lock(&self.scene).take();
        self.phase.send_replace(state);
    }

    /// Somebody takes something of its results.
    pub(super) fn is_fetched(&self) {
        *lock(&self.fetched) = Some(Instant::now());
    }

    /// Nobody is about to come for its results, or for more of them, as far as one can tell who
    /// has waited for so long since it ended.
    fn is_left(&self, wait: Duration) -> bool {
        let ended = lock(&self.times).ended;
        ended.is_some_and(|at| match *lock(&self.fetched) {
            Some(fetched) => fetched.elapsed() > BETWEEN_TABLES,
            None => at.elapsed() > wait || !matches!(self.phase(), Phase::Finished(_)),
        })
    }

    /// As a list shows it.
    pub(super) fn info(&self) -> v1::SolveInfo {
        let stage = self.progress.now();
        let times = *lock(&self.times);
        let until = times.ended.unwrap_or_else(Instant::now);
        let running = times.begun.map(|begun| until - begun);
        v1::SolveInfo {
            solve_id: self.id.to_string(),
            scene_id: self.scene_id.to_string(),
            state: self.phase().message().into(),
            triangles: self.triangles,
            bands: self.bands,
            stage: stage.name,
            done: stage.done,
            total: stage.total,
            age_s: self.queued.elapsed().as_secs_f64(),
            running_s: running.unwrap_or_default().as_secs_f64(),
        }
    }
}

/// All solves.
#[derive(Debug)]
pub(super) struct Solves {
    started_ns: u128,
    most_queued: usize,
    most_bytes: u64,
    known: Mutex<Known>,
    /// There is something to compute, or nothing more will come.
    work: Condvar,
}

#[derive(Debug, Default)]
struct Known {
    number: u64,
    /// Oldest first.
    solves: VecDeque<Arc<Solve>>,
    stopping: bool,
    /// Threads that compute.
    solvers: usize,
}

impl Solves {
    pub(super) fn new(most_queued: usize, most_bytes: u64) -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        Self {
            started_ns: since.unwrap_or_default().as_nanos(),
            most_queued,
            most_bytes,
            known: Mutex::default(),
            work: Condvar::new(),
        }
    }

    /// Puts a solve into the queue.
    pub(super) fn start(
        &self,
        scene: HeldScene,
        settings: Settings,
    ) -> Result<Arc<Solve>, ServiceError> {
        let least = HeldSolution::least_bytes(&scene);
        if least > self.most_bytes {
            let message = format!(
                "the results take {least} bytes: the master holds {} bytes of results at most",
                self.most_bytes
            );
            return Err(ServiceError::new(ErrorCode::Exhausted, message));
        }
        let mut known = self.lock();
        if known.stopping {
            return Err(stopping());
        }
        if known.waiting().count() >= self.most_queued {
            let message = format!("{} solves wait already", self.most_queued);
            return Err(ServiceError::new(ErrorCode::Exhausted, message));
        }
        known.number += 1;
        let solve = Arc::new(Solve {
            id: solve_id(self.started_ns, known.number),
            scene_id: scene.id,
            triangles: scene.geometry().canopy.len() as u64,
            bands: scene.lighting().optics.len() as u32,
            settings,
            progress: Progress::default(),
            stop: Stop::default(),
            scene: Mutex::new(Some(scene)),
            phase: watch::Sender::new(Phase::Queued),
            plan: Mutex::default(),
            queued: Instant::now(),
            times: Mutex::default(),
            fetched: Mutex::default(),
        });
        known.solves.push_back(solve.clone());
        self.forget(&mut known);
        self.work.notify_one();
        Ok(solve)
    }

    /// The next solve to compute; waits for it. None when the master stops.
    fn next(&self) -> Option<Arc<Solve>> {
        let mut known = self.lock();
        loop {
            if let Some(solve) = known.waiting().next().cloned() {
                lock(&solve.times).begun = Some(Instant::now());
                solve.phase.send_replace(Phase::Running);
                return Some(solve);
            }
            if known.stopping {
                return None;
            }
            known = self
                .work
                .wait(known)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// What came of a solve that was computed.
    fn ended(&self, solve: &Solve, state: Phase) {
        let mut known = self.lock();
        solve.end(state);
        self.forget(&mut known);
    }

    /// A solve that is known.
    pub(super) fn get(&self, id: &str) -> Result<Arc<Solve>, ServiceError> {
        let found = Id::parse(id).and_then(|id| {
            let known = self.lock();
            known.solves.iter().find(|solve| solve.id == id).cloned()
        });
        found.ok_or_else(|| {
            let shown: String = id.chars().take(40).flat_map(char::escape_debug).collect();
            let message =
                format!("the master does not hold solve '{shown}' (any more): start it again");
            ServiceError::new(ErrorCode::NotFound, message)
        })
    }

    /// Ends a solve that waits, asks a running one to stop.
    pub(super) fn cancel(&self, solve: &Solve) -> Phase {
        let mut known = self.lock();
        match solve.phase() {
            Phase::Queued => {
                solve.end(Phase::Cancelled);
                self.forget(&mut known);
            }
            Phase::Running => solve.stop.stop(),
            _ => {}
        }
        solve.phase()
    }

    /// Solves that come before this one.
    pub(super) fn ahead_of(&self, solve: &Solve) -> u32 {
        let known = self.lock();
        let before = known.solves.iter().take_while(|other| other.id != solve.id);
        before.filter(|other| !other.phase().has_ended()).count() as u32
    }

    /// All that are known, oldest first.
    pub(super) fn all(&self) -> Vec<Arc<Solve>> {
        let mut known = self.lock();
        self.forget(&mut known);
        known.solves.iter().cloned().collect()
    }

    /// Takes no more solves.
    pub(super) fn stop(&self) {
        self.lock().stopping = true;
        self.work.notify_all();
    }

    /// Whether no more are taken.
    pub(super) fn is_stopping(&self) -> bool {
        self.lock().stopping
    }

    /// Bytes of all results.
    pub(super) fn result_bytes(&self) -> u64 {
        self.lock()
            .solves
            .iter()
            .map(|solve| solve.phase().bytes())
            .sum()
    }

    /// Every solve has ended, and whoever wanted its results has them, or did not come within that time.
    pub(super) fn is_quiet(&self, wait: Duration) -> bool {
        self.lock().solves.iter().all(|solve| solve.is_left(wait))
    }

    /// Every solve has ended.
    pub(super) fn is_idle(&self) -> bool {
        self.lock()
            .solves
            .iter()
            .all(|solve| solve.phase().has_ended())
    }

    /// Drops what has ended, the oldest first, until the rest is within its bounds.
    fn forget(&self, known: &mut Known) {
        let ended = |solve: &Solve| solve.phase().has_ended();
        let too_old = |solve: &Solve| {
            lock(&solve.times)
                .ended
                .is_some_and(|at| at.elapsed() > KEPT)
        };
        known.solves.retain(|solve| !too_old(solve));
        let mut count = known.solves.iter().filter(|solve| ended(solve)).count();
        let mut bytes: u64 = known.solves.iter().map(|solve| solve.phase().bytes()).sum();
        known.solves.retain(|solve| {
            let drop = ended(solve) && count > 1 && (count > MAX_ENDED || bytes > self.most_bytes);
            if drop {
                count -= 1;
                bytes -= solve.phase().bytes();
            }
            !drop
        });
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        lock(&self.known)
    }
}

impl Known {
    fn waiting(&self) -> impl Iterator<Item = &Arc<Solve>> {
        let queued = |solve: &&Arc<Solve>| matches!(solve.phase(), Phase::Queued);
        self.solves.iter().filter(queued)
    }
}

/// The answer to what comes too late.
pub(super) fn stopping() -> ServiceError {
    ServiceError::new(ErrorCode::Stopping, "the master is about to stop")
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // what is behind these locks is whole at any time, even if a thread died with one
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
