//! A solve from beginning to end, in this process.

use nestrad_common::problem::Problem;
use thiserror::Error;

use crate::direct::direct_light;
use crate::exchange::{BlockOf, Exchange, ExchangeError, Outlook, Traced, trace_here};
use crate::output::progress::Progress;
use crate::output::resources::Stopwatch;
use crate::plan::Plan;
use crate::results::Parts;
use crate::solution::Solution;
use crate::solver::{self, Irradiance, SolveError};

/// What a solve gives, and what it took.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The results.
    pub solution: Solution,
    /// How much was computed.
    pub counters: Counters,
}

/// How much was computed.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Counters {
    /// Elements that triangles were cut into.
    pub elements: usize,
    /// Lattice points of the direct light.
    pub direct_lines: u64,
    /// Lines, segments, rays and row entries of the exchange.
    pub exchange: Traced,
    /// Passes of the solver over all rows.
    pub passes: u32,
}

/// Why a solve failed.
#[derive(Debug, Error)]
pub enum RunError {
    /// The exchange could not be computed.
    #[error(transparent)]
    Exchange(#[from] ExchangeError),
    /// The solver did not converge.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

/// Solves a problem as planned.
pub fn solve(
    problem: &Problem,
    plan: &Plan,
    progress: &Progress,
    watch: &mut Stopwatch,
) -> Result<Finished, RunError> {
    let world = plan.world(problem);
    watch.lap("elements");
    let seed = plan.sampling.map_or(1, |s| s.seed);
    let direct = direct_light(problem, &world, &plan.direct_line_areas_m2(problem), seed);
    watch.lap("direct light");

    let mut exchange = Exchange::default();
    let mut outlook = Outlook::default();
    let mut irradiance = Irradiance::default();
    if let Some(sampling) = &plan.sampling {
        progress.stage("exchange", u64::from(sampling.batches));
        exchange = trace_here(
            &problem.scene,
            &world,
            &[BlockOf::whole(&world)],
            sampling,
            || progress.inc(1),
        )?;
        progress.finish();
        watch.lap("exchange");
        outlook = exchange.outlook(&world);
        let fixed = vec![0.0; (world.ends.len() - world.rows()) * problem.bands.len()];
        irradiance = solver::solve(
            problem,
            &world,
            &exchange,
            &outlook,
            &direct.irradiance_W_m2,
            &fixed,
            &plan.scattering_bands,
            &direct.incoming_W,
            &plan.tolerance,
        )?;
        watch.lap("solve");
    }
    let parts = Parts {
        problem,
        world: &world,
        direct: &direct,
        outlook: &outlook,
        irradiance: &irradiance,
        scattering: &plan.scattering_bands,
    };
    let solution = parts.assemble();
    watch.lap("results");
    let counters = Counters {
        elements: world.elements.len(),
        direct_lines: direct.lines,
        exchange: exchange.counters,
        passes: irradiance.passes,
    };
    Ok(Finished { solution, counters })
}
