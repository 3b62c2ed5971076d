//! The threads that solve: never those of tokio.

use std::sync::Arc;

use nestrad_cluster::store::Store;
use nestrad_cluster::{Cluster, with_rows};
use nestrad_common::panics;
use nestrad_engine::causes::causes;
use nestrad_engine::heap::Freed;
use nestrad_engine::plan::Plan;
use nestrad_engine::rounds::{Round, RoundsError, light_in_rounds};
use nestrad_engine::run::Run;
use nestrad_engine::stopwatch::Stopwatch;
use nestrad_engine::traced::FailureKind;
use rayon::ThreadPool;
use thiserror::Error;

use super::metrics::Metrics;
use super::residents::Residents;
use super::scenes::HeldScene;
use super::solution::HeldSolution;
use super::solve::{Phase, Solve};
use super::solves::{Solver, Solves};

/// What a master computes with.
pub(super) struct Means<'a> {
    pub(super) pool: &'a ThreadPool,
    /// Those that may come: a master without workers computes by itself.
    pub(super) workers: &'a Cluster,
    pub(super) kept: Option<&'a Store>,
    /// Canopies that other solves have traced.
    pub(super) residents: &'a Residents,
}

/// Solves what is in the queue, one solve after the other, until the master stops. Whatever happens in between, a
/// solve that was begun ends.
pub(super) fn work(solves: &Solves, means: &Means, metrics: &Metrics, may_die: impl Fn()) {
    let solver = Solver::of(solves, metrics);
    let mut freed = Freed::default();
    while let Some(solve) = solver.next() {
        let span = tracing::info_span!("solve", id = %solve.id);
        let _entered = span.enter();
        may_die();
        tracing::info!(triangles = solve.triangles, bands = solve.bands, "begins");
        // a fault of the program ends the solve, not the master
        let ended = panics::caught(|| means.pool.install(|| end_of(&solve, means, metrics)));
        let fault = |panic| Phase::Failed(FailureKind::Fault, format!("internal fault: {panic}"));
        let phase = ended.unwrap_or_else(fault);
        match &phase {
            Phase::Finished(solution) => {
                let summary = &solution.summary;
                if !summary.fault.is_empty() {
                    let fault = summary.fault.as_str();
                    tracing::warn!(fault, "a finer round failed: the accuracy is missed");
                }
                tracing::info!(wall_s = summary.wall_s, "finished");
            }
            Phase::Failed(_, reason) => tracing::warn!(reason, "failed"),
            _ => tracing::info!("cancelled"),
        }
        solve.ends(phase);
        freed.give_back();
    }
}

/// Computes a solve, and says how it ended.
fn end_of(solve: &Solve, means: &Means, metrics: &Metrics) -> Phase {
    let Some(scene) = solve.take_scene() else {
        return Phase::Cancelled;
    };
    match solution(solve, means, &scene) {
        Ok(solution) => {
            metrics.solved(&solution.summary);
            Phase::Finished(Arc::new(solution))
        }
        Err(fault) => match fault.kind() {
            FailureKind::Cancelled => Phase::Cancelled,
            kind => Phase::Failed(kind, causes(&fault)),
        },
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

impl Fault {
    fn kind(&self) -> FailureKind {
        match self {
            Self::Rounds(error) => error.kind(),
            Self::Json(_) => FailureKind::Fault,
        }
    }
}

fn solution(solve: &Solve, means: &Means, held: &HeldScene) -> Result<HeldSolution, Fault> {
    let mut watch = Stopwatch::start();
    solve.progress.stage("plan", 0);
    let run = Run {
        stop: &solve.stop,
        progress: &solve.progress,
    };
    let begins = |plan: &Plan, _: &[Round]| solve.set_plan(&plan.reasons);
    let workers = means.workers.has_workers().then_some(means.workers);
    let scene = held.scene();
    let settings = &solve.settings;
    let solved = with_rows(workers, means.kept, |rows| {
        let untrusted = || means.workers.status().untrusted.len();
        let geometry = held.geometry().id;
        let mut used = means.residents.take(geometry, settings, untrusted());
        let lit = (&scene, &mut used.resident);
        let solved = light_in_rounds(lit, settings, rows, &run, &mut watch, begins);
        means.residents.give_back(used, untrusted());
        solved
    })?;
    let usage = watch.usage();
    Ok(HeldSolution::new(held, solved, watch.stages(), usage)?)
}
