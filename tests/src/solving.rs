//! Solves, from a problem to its results.

use nestrad_common::directions::Axes;
use nestrad_common::problem::Problem;
use nestrad_master::exchange::Sampling;
use nestrad_master::output::progress::Progress;
use nestrad_master::output::resources::Stopwatch;
use nestrad_master::plan::{Estimator, Plan, Settings};
use nestrad_master::run::{self, Finished, RunError};
use nestrad_master::solution::Solution;

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

/// What nestrad plans to do.
pub fn plan(problem: &Problem, settings: &Settings) -> Plan {
    Plan::new(problem, settings).unwrap()
}

/// Solves as planned for these settings.
pub fn solve(problem: &Problem, settings: &Settings) -> Finished {
    finish(problem, &plan(problem, settings)).unwrap()
}

/// Solves by a plan that a test has changed.
pub fn finish(problem: &Problem, plan: &Plan) -> Result<Finished, RunError> {
    run::solve(problem, plan, &Progress::new(true), &mut Stopwatch::start())
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
