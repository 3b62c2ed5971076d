//! The solves that the master knows: those that wait, those that are computed, and what came of the
//! others. Of bounded number and size. What came of a solve is kept until its client has it, or until the time for
//! that is over; only what is not awaited any more makes room for others.

mod solver;

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime};

use super::admission::{self, Bounds};
use super::caller::Caller;
use super::error::{ErrorCode, ServiceError};
use super::identity::{Id, solve_id};
use super::lock::lock;
use super::scenes::HeldScene;
use super::solve::{Phase, Solve};
use nestrad_engine::plan::Settings;

pub(super) use solver::Solver;

/// Solves that have ended, are not awaited, and are kept, however small their results.
const MAX_ENDED: usize = 256;

/// What has ended is forgotten after this.
const REMEMBERED: Duration = Duration::from_secs(24 * 3600);

/// All solves.
#[derive(Debug)]
pub(super) struct Solves {
    started_ns: u128,
    bounds: Bounds,
    /// Computed at a time.
    at_a_time: usize,
    known: Mutex<Known>,
    /// There is something to compute, or nothing more will come.
    work: Condvar,
}

#[derive(Debug, Default)]
struct Known {
    number: u64,
    /// Oldest first.
    solves: Vec<Arc<Solve>>,
    /// What one takes, seconds, about: of the last ones.
    mean_s: f64,
    stopping: bool,
    /// Threads that compute.
    solvers: usize,
}

impl Solves {
    pub(super) fn new(bounds: Bounds, at_a_time: usize) -> Self {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        Self {
            started_ns: since.unwrap_or_default().as_nanos(),
            bounds,
            at_a_time,
            known: Mutex::default(),
            work: Condvar::new(),
        }
    }

    /// Puts a solve into the queue.
    pub(super) fn start(
        &self,
        caller: Caller,
        scene: HeldScene,
        settings: Settings,
    ) -> Result<Arc<Solve>, ServiceError> {
        let mut known = self.lock();
        if known.stopping {
            return Err(stopping());
        }
        known.number += 1;
        let id = solve_id(self.started_ns, known.number);
        let solve = Arc::new(Solve::new(id, caller, scene, settings));
        let turn_s = known.mean_s / self.at_a_time as f64;
        self.bounds.check(&known.solves, &solve, turn_s)?;
        known.solves.push(solve.clone());
        self.forget(&mut known);
        self.work.notify_one();
        Ok(solve)
    }

    /// The next solve to compute; waits for it. None when the master stops.
    fn next(&self) -> Option<Arc<Solve>> {
        let mut known = self.lock();
        loop {
            if let Some(number) = admission::next(&known.solves) {
                let solve = known.solves[number].clone();
                solve.begin();
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
        if let Some(begun) = solve.begun() {
            known.mean_s += 0.2 * (begun.elapsed().as_secs_f64() - known.mean_s);
        }
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

    /// Solves that come before this one, about.
    pub(super) fn ahead_of(&self, solve: &Solve) -> u32 {
        admission::ahead_of(&self.lock().solves, solve) as u32
    }

    /// All that are known, oldest first.
    pub(super) fn all(&self) -> Vec<Arc<Solve>> {
        let mut known = self.lock();
        self.forget(&mut known);
        known.solves.clone()
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
        let known = self.lock();
        let ended = known.solves.iter().filter(|solve| solve.has_ended());
        ended.map(|solve| solve.bytes()).sum()
    }

    /// Every solve has ended, and whoever wanted its results has them, or did not come within that time.
    pub(super) fn is_quiet(&self, wait: Duration) -> bool {
        self.lock().solves.iter().all(|solve| solve.is_left(wait))
    }

    /// Every solve has ended.
    pub(super) fn is_idle(&self) -> bool {
        self.lock().solves.iter().all(|solve| solve.has_ended())
    }

    /// Drops what is not awaited until the rest is within its bounds: what was cancelled first, then the oldest.
    fn forget(&self, known: &mut Known) {
        let solves = &mut known.solves;
        solves.retain(|solve| !solve.has_ended_before(REMEMBERED));
        let mut bytes: u64 = solves.iter().map(|solve| solve.bytes()).sum();
        let awaited: Vec<bool> = solves.iter().map(|solve| solve.is_awaited()).collect();
        let mut count = awaited.iter().filter(|&&awaited| !awaited).count();
        let mut order: Vec<usize> = (0..solves.len()).filter(|&k| !awaited[k]).collect();
        order.sort_by_key(|&k| !matches!(solves[k].phase(), Phase::Cancelled));
        let mut dropped = vec![false; solves.len()];
        for k in order {
            let freed = solves[k].bytes();
            if count > MAX_ENDED || (bytes > self.bounds.result_bytes && freed > 0) {
                dropped[k] = true;
                count -= 1;
                bytes -= freed;
            }
        }
        let mut dropped = dropped.into_iter();
        solves.retain(|_| !dropped.next().unwrap_or_default());
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        lock(&self.known)
    }
}

/// The answer to what comes too late.
pub(super) fn stopping() -> ServiceError {
    ServiceError::new(ErrorCode::Stopping, "the master is about to stop")
}
