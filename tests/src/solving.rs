//! Plans and solves, from a scene to its results: the one place where tests call the engine for a whole solve.

use nestrad_common::canopy::Canopy;
use nestrad_common::light::Sources;
use nestrad_common::scene::Scene;
use nestrad_engine::exchange::{Exchange, RowSource, Sampling, ThisProcess};
use nestrad_engine::frame::Frame;
use nestrad_engine::lit_canopy::LitCanopy;
use nestrad_engine::plan::{Aims, Estimator, Plan, PlanError, Settings, TracePlan};
use nestrad_engine::progress::Progress;
use nestrad_engine::rounds::{self, RoundsError, solve_in_rounds};
use nestrad_engine::run::Run;
use nestrad_engine::solution::Solution;
use nestrad_engine::stop::Stop;
use nestrad_engine::stopwatch::Stopwatch;
use nestrad_engine::traced::{self, SolveError, WorkDone};
use nestrad_kernel::directions::Axes;

/// Both ways of sampling the exchange.
pub const ESTIMATORS: [Estimator; 2] = [Estimator::Lines, Estimator::Rays];

/// Settings that differ from the defaults by the estimator alone.
pub fn by(estimator: Estimator) -> Settings {
    Settings {
        estimator,
        ..Settings::default()
    }
}

/// Settings for tests that compare solves of a small scene with one another: three times coarser than
/// the defaults.
pub fn coarse() -> Settings {
    Settings {
        accuracy_percent: 1.5,
        ..Settings::default()
    }
}

/// What came of a solve.
#[derive(Clone, Debug)]
pub struct Solved {
    /// The results.
    pub solution: Solution,
    /// How much was computed.
    pub work: WorkDone,
}

/// What nestrad plans to do.
pub fn plan(scene: &Scene, settings: &Settings) -> Plan {
    try_plan(scene, settings).unwrap()
}

/// What nestrad plans to do, or why it cannot.
pub fn try_plan(scene: &Scene, settings: &Settings) -> Result<Plan, PlanError> {
    let sources = sources(scene, &Aims::of(settings.accuracy_percent), settings.seed);
    Plan::new(&lit(scene, &sources), settings)
}

/// What nestrad plans to do with an error to aim at for each part.
pub fn aimed(scene: &Scene, settings: &Settings, aims: &Aims) -> Plan {
    let sources = sources(scene, aims, settings.seed);
    Plan::aimed(&lit(scene, &sources), settings, aims).unwrap()
}

/// Solves as planned for these settings.
pub fn solve(scene: &Scene, settings: &Settings) -> Solved {
    finish(scene, &plan(scene, settings)).unwrap()
}

/// Solves by a plan that a test has changed.
pub fn finish(scene: &Scene, plan: &Plan) -> Result<Solved, SolveError> {
    finish_by(scene, plan, &ThisProcess::default())
}

/// The same with rows from a source.
pub fn finish_by(scene: &Scene, plan: &Plan, rows: &dyn RowSource) -> Result<Solved, SolveError> {
    let sources = sources(scene, &plan.aims, plan.light.seed);
    finish_lit(&lit(scene, &sources), plan, rows)
}

/// The same under sources that a test has chosen.
pub fn finish_lit(
    lit: &LitCanopy,
    plan: &Plan,
    rows: &dyn RowSource,
) -> Result<Solved, SolveError> {
    let watch = &mut Stopwatch::start();
    let (solution, work) = unwatched(|run| traced::solve(lit, plan, rows, run, watch))?;
    Ok(Solved { solution, work })
}

/// Solves in rounds, as the program does.
pub fn in_rounds(scene: &Scene, settings: &Settings) -> Result<rounds::Solved, RoundsError> {
    in_rounds_by(scene, settings, &ThisProcess::default())
}

/// The same with rows from a source.
pub fn in_rounds_by(
    scene: &Scene,
    settings: &Settings,
    rows: &dyn RowSource,
) -> Result<rounds::Solved, RoundsError> {
    let watch = &mut Stopwatch::start();
    unwatched(|run| solve_in_rounds(scene, settings, rows, run, watch, |_, _| ()))
}

/// The sources of a scene, with as many directions of its sky as aims ask for.
pub fn sources(scene: &Scene, aims: &Aims, seed: u64) -> Sources {
    scene.light.sources(aims.sky_directions(), seed)
}

/// A scene under these sources, in place of its own light.
pub fn lit<'a>(scene: &'a Scene, sources: &'a Sources) -> LitCanopy<'a> {
    LitCanopy {
        canopy: &scene.canopy,
        optics: &scene.optics,
        sources,
        sensors: &scene.sensors,
    }
}

/// Lends a run that nobody stops and nobody looks at.
pub fn unwatched<T>(work: impl FnOnce(&Run) -> T) -> T {
    work(&Run {
        stop: &Stop::default(),
        progress: &Progress::default(),
    })
}

/// A canopy, cut and numbered as planned.
pub fn frame(canopy: &Canopy, plan: &TracePlan) -> Frame {
    Frame::new(canopy, &plan.cut()).unwrap()
}

/// What all sees, by a source of rows.
pub fn trace(frame: &Frame, sampling: &Sampling, rows: &dyn RowSource) -> Exchange {
    unwatched(|run| Exchange::trace(frame, sampling, rows, run)).unwrap()
}

/// A sampling of 16 batches by lines of that pitch, or by that many rays a face in each half.
pub fn sampling(estimator: Estimator, pitch_m: f64, rays: f64) -> Sampling {
    let lines = estimator == Estimator::Lines;
    Sampling {
        batches: 16,
        axes: Axes::Both,
        sets_per_batch: u32::from(lines),
        line_area_m2: pitch_m * pitch_m,
        least_samples: if lines { 4.0 } else { rays },
        seed: 1,
    }
}

/// Where the light of a band goes, as parts of what comes in.
#[derive(Clone, Copy, Debug)]
pub struct Shares {
    /// Absorbed by plants.
    pub plants: f64,
    /// Absorbed by the soil.
    pub soil: f64,
    /// Back to the sky.
    pub up: f64,
    /// Into the void.
    pub down: f64,
    /// What is not accounted for.
    pub closure: f64,
}

/// The shares of a band.
pub fn shares(solution: &Solution, band: usize) -> Shares {
    let balance = &solution.balance[band];
    let part = |watts: f64| watts / balance.incoming_W;
    Shares {
        plants: part(balance.absorbed_plants_W.value),
        soil: part(balance.absorbed_soil_W.value),
        up: part(balance.escaped_up_W.value),
        down: part(balance.escaped_down_W.value),
        closure: part(balance.closure_W.value),
    }
}

/// Rms over organs of how far absorbed powers per area lie apart, percent of the mean.
pub fn apart_percent(a: &Solution, b: &Solution, band: usize) -> f64 {
    let bands = a.balance.len();
    let (mut area, mut mean, mut square) = (0.0, 0.0, 0.0);
    for (organ, &own) in a.organ_area_m2.iter().enumerate() {
        let [x, y] = [a, b].map(|s| &s.organs[organ * bands + band]);
        area += own;
        mean += y.absorbed_W;
        square += (x.absorbed_W - y.absorbed_W).powi(2) / own;
    }
    100.0 * (square * area).sqrt() / mean
}
