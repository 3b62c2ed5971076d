//! The threads that solve: never those of tokio.

use std::error::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use rayon::ThreadPool;
use thiserror::Error;

use super::metrics::Metrics;
use super::outcome::Outcome;
use super::scenes::HeldScene;
use super::solves::{Job, Solves, State};
use crate::heap::Freed;
use crate::output::resources::Stopwatch;
use crate::plan::Plan;
use crate::rounds::{Round, RoundsError, solve_in_rounds};
use crate::run::Means;

/// Solves what is in the queue, one solve after the other, until the master stops.
pub(super) fn work<'a>(
    solves: &Solves,
    pool: &ThreadPool,
    means: impl Fn() -> Means<'a> + Sync,
    metrics: &Metrics,
) {
    let mut freed = Freed::default();
    while let Some(job) = solves.next() {
        let span = tracing::info_span!("solve", id = %job.id);
        let _entered = span.enter();
        tracing::info!(triangles = job.triangles, bands = job.bands, "begins");
        // a fault of the program ends the solve, not the master
        let solved = catch_unwind(AssertUnwindSafe(|| {
            pool.install(|| solve(&job, means(), metrics))
        }));
        let state = solved.unwrap_or_else(|_| State::Failed("internal fault".to_owned()));
        let state = match state {
            State::Failed(_) if job.progress.check().is_err() => State::Cancelled,
            state => state,
        };
        match &state {
            State::Finished(outcome) => {
                tracing::info!(wall_s = outcome.summary.wall_s, "finished");
            }
            State::Failed(reason) => tracing::warn!(reason, "failed"),
            _ => tracing::info!("cancelled"),
        }
        metrics.ended(&state);
        solves.ended(&job, state);
        freed.give_back();
    }
}

fn solve(job: &Job, means: Means, metrics: &Metrics) -> State {
    let Some(scene) = job.take_scene() else {
        return State::Cancelled;
    };
    match outcome(job, means, &scene) {
        Ok(outcome) => {
            metrics.solved(&outcome.summary);
            State::Finished(Arc::new(outcome))
        }
        Err(fault) => State::Failed(chain(&fault)),
    }
}

/// Why a solve has no result.
#[derive(Debug, Error)]
enum Fault {
    #[error(transparent)]
    Rounds(#[from] RoundsError),
    #[error("the plan cannot be written down")]
    Json(#[from] serde_json::Error),
}

/// An error and its causes in one line.
fn chain(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text.push_str(": ");
        text.push_str(&error.to_string());
        cause = error.source();
    }
    text
}

fn outcome(job: &Job, means: Means, scene: &HeldScene) -> Result<Outcome, Fault> {
    let mut watch = Stopwatch::start();
    job.progress.stage("plan", 0);
    let problem = scene.problem();
    let (settings, progress) = (&job.settings, &job.progress);
    let begins = |plan: &Plan, _: &[Round]| job.set_plan(&plan.reasons);
    let watch = &mut watch;
    let reached = solve_in_rounds(&problem, None, settings, means, progress, watch, begins)?;
    let usage = watch.usage();
    Ok(Outcome::new(scene, reached, watch.stages(), usage)?)
}
