//! A solve from its start until it is forgotten: where it is, and whether its client has what came of it.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use nestrad_proto::v1;
use tokio::sync::watch;

use super::caller::Caller;
use super::identity::Id;
use super::lock::lock;
use super::scenes::HeldScene;
use super::solution::HeldSolution;
use nestrad_engine::plan::Settings;
use nestrad_engine::progress::Progress;
use nestrad_engine::stop::Stop;
use nestrad_engine::traced::FailureKind;

/// Results that nobody has come for are kept for so long after the end, whatever else wants their room.
const KEPT: Duration = Duration::from_secs(600);

/// The same after one of their tables was fetched, as long as others are left: longer than a client looks for a master
/// that it has lost.
const BETWEEN_TABLES: Duration = Duration::from_secs(90);

/// A client that fetches one table after the other from a master that stops pauses no longer.
const BETWEEN_TABLES_AT_THE_END: Duration = Duration::from_secs(1);

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
}

/// A solve.
#[derive(Debug)]
pub(super) struct Solve {
    pub(super) id: Id,
    /// Who started it.
    pub(super) caller: Caller,
    pub(super) scene_id: Id,
    pub(super) triangles: u64,
    pub(super) bands: u32,
    pub(super) settings: Settings,
    pub(super) progress: Progress,
    pub(super) stop: Stop,
    /// What its results take, as far as the scene says.
    expected_bytes: u64,
    /// Taken by the thread that computes it, so that a solve that has ended holds no scene.
    scene: Mutex<Option<HeldScene>>,
    geometry: (Id, u64),
    phase: watch::Sender<Phase>,
    plan: Mutex<Vec<String>>,
    queued: Instant,
    times: Mutex<Times>,
    fetched: Mutex<Fetched>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Times {
    begun: Option<Instant>,
    ended: Option<Instant>,
}

/// What somebody has of the results.
#[derive(Clone, Copy, Debug, Default)]
struct Fetched {
    /// When the last of them went out.
    last: Option<Instant>,
    tables: Tables,
}

/// Tables that went out to their ends.
#[derive(Clone, Copy, Debug, Default)]
struct Tables {
    organs: bool,
    triangles: bool,
    soil: bool,
    sensors: bool,
    summary: bool,
}

impl Tables {
    fn any(self) -> bool {
        self.organs || self.triangles || self.soil || self.sensors || self.summary
    }
}

impl Solve {
    pub(super) fn new(id: Id, caller: Caller, scene: HeldScene, settings: Settings) -> Self {
        Self {
            id,
            caller,
            scene_id: scene.id,
            triangles: scene.geometry().canopy.len() as u64,
            bands: scene.lighting().optics.len() as u32,
            settings,
            progress: Progress::default(),
            stop: Stop::default(),
            expected_bytes: HeldSolution::least_bytes(&scene),
            geometry: (scene.geometry().id, scene.geometry_bytes()),
            scene: Mutex::new(Some(scene)),
            phase: watch::Sender::new(Phase::Queued),
            plan: Mutex::default(),
            queued: Instant::now(),
            times: Mutex::default(),
            fetched: Mutex::default(),
        }
    }

    pub(super) fn phase(&self) -> Phase {
        self.phase.borrow().clone()
    }

    pub(super) fn has_ended(&self) -> bool {
        self.phase.borrow().has_ended()
    }

    pub(super) fn is_queued(&self) -> bool {
        matches!(*self.phase.borrow(), Phase::Queued)
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

    pub(super) fn begin(&self) {
        lock(&self.times).begun = Some(Instant::now());
        self.phase.send_replace(Phase::Running);
    }

    /// When it began to be computed, if it did.
    pub(super) fn begun(&self) -> Option<Instant> {
        lock(&self.times).begun
    }

    /// Where it ended, what came of it.
    pub(super) fn end(&self, state: Phase) {
        lock(&self.times).ended = Some(Instant::now());
        lock(&self.scene).take();
        self.phase.send_replace(state);
    }

    pub(super) fn has_ended_before(&self, time: Duration) -> bool {
        lock(&self.times)
            .ended
            .is_some_and(|at| at.elapsed() > time)
    }

    /// Bytes of its results, or that they will take.
    pub(super) fn bytes(&self) -> u64 {
        match &*self.phase.borrow() {
            Phase::Finished(outcome) => outcome.bytes(),
            Phase::Queued | Phase::Running => self.expected_bytes,
            Phase::Failed(..) | Phase::Cancelled => 0,
        }
    }

    /// The geometry that it holds until it has ended, and its bytes.
    pub(super) fn geometry(&self) -> Option<(Id, u64)> {
        (!self.has_ended()).then_some(self.geometry)
    }

    /// Somebody takes something of its results.
    pub(super) fn is_fetched(&self) {
        lock(&self.fetched).last = Some(Instant::now());
    }

    /// Somebody has taken all of a table.
    pub(super) fn has_fetched(&self, table: v1::ResultTable) {
        let mut fetched = lock(&self.fetched);
        fetched.last = Some(Instant::now());
        let tables = &mut fetched.tables;
        match table {
            v1::ResultTable::Organs => tables.organs = true,
            v1::ResultTable::Triangles => tables.triangles = true,
            v1::ResultTable::Soil => tables.soil = true,
            v1::ResultTable::Sensors => tables.sensors = true,
            v1::ResultTable::Summary => tables.summary = true,
            v1::ResultTable::Unspecified => {}
        }
    }

    /// Somebody knows why it has failed.
    pub(super) fn is_told(&self) {
        self.has_fetched(v1::ResultTable::Summary);
    }

    /// Whether it is still to be kept: what came of it has not been fetched, and the time for that is not over.
    pub(super) fn is_awaited(&self) -> bool {
        let Some(ended) = lock(&self.times).ended else {
            return true;
        };
        let Fetched { last, tables } = *lock(&self.fetched);
        let in_time = |missing: bool| {
            let (since, limit) = match last {
                Some(last) if tables.any() => (last, BETWEEN_TABLES),
                // half a table is nothing
                _ => (ended, KEPT),
            };
            missing && since.elapsed() <= limit
        };
        match &*self.phase.borrow() {
            Phase::Finished(outcome) => {
                let soil = tables.soil || outcome.solution.soil.is_none();
                let sensors = tables.sensors || outcome.solution.readings.is_empty();
                let all = tables.organs && tables.triangles && soil && sensors;
                // whoever fetches the summary last has fetched all that he wants
                in_time(!(tables.summary || all))
            }
            Phase::Failed(..) => in_time(!tables.summary),
            _ => false,
        }
    }

    /// Nobody is about to come for its results, or for more of them, as far as one can tell who
    /// has waited for so long since it ended.
    pub(super) fn is_left(&self, wait: Duration) -> bool {
        let ended = lock(&self.times).ended;
        ended.is_some_and(|at| match lock(&self.fetched).last {
            Some(last) => last.elapsed() > BETWEEN_TABLES_AT_THE_END,
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
