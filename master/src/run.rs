//! A solve from beginning to end, in this process.

use nestrad_common::problem::Problem;
use thiserror::Error;

use crate::direct::direct_light;
use crate::exchange::{BlockOf, Exchange, ExchangeError, Outlook, Traced, trace_here};
use crate::far_field::closure::{FarRows, from_layers};
use crate::output::progress::{Cancelled, Progress};
use crate::output::resources::Stopwatch;
use crate::plan::Plan;
use crate::results::Parts;
use crate::solution::Solution;
use crate::solver::{Irradiance, SolveError, System};
use crate::world::{World, outer_soil_radiosity_W_m2};

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
    /// It is not wanted any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Solves a problem as planned, or stops at the end of a step if `progress` is told so.
pub fn solve(
    problem: &Problem,
    plan: &Plan,
    progress: &Progress,
    watch: &mut Stopwatch,
) -> Result<Finished, RunError> {
    let world = plan.world(problem);
    watch.lap("elements");
    progress.check()?;
    progress.stage("direct light", 0);
    let direct = direct_light(
        problem,
        &world,
        &plan.direct_line_areas_m2(problem),
        plan.seed,
    );
    watch.lap("direct light");
    progress.check()?;

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
            || {
                progress.inc(1);
                progress.check()
            },
        )?;
        watch.lap("exchange");
        progress.stage("far field", 0);
        outlook = exchange.outlook(&world);
        let far = plan
            .far_field
            .map(|f| FarRows::trace(problem, &world, &f))
            .transpose()
            .map_err(ExchangeError::from)?;
        let fixed_W_m2 = fixed(problem, &world, plan);
        watch.lap("far field");
        progress.check()?;
        progress.stage("solve", 0);
        let system = System {
            problem,
            world: &world,
            exchange: &exchange,
            outlook: &outlook,
            far: far.as_ref(),
            direct_W_m2: &direct.irradiance_W_m2,
            fixed_W_m2: &fixed_W_m2,
            incoming_W: &direct.incoming_W,
        };
        irradiance = system.solve(&plan.scattering_bands, &plan.tolerance)?;
        watch.lap("solve");
        progress.check()?;
    }
    progress.stage("results", 0);
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
    progress.finish();
    let counters = Counters {
        elements: world.elements.len(),
        direct_lines: direct.lines,
        exchange: exchange.counters,
        passes: irradiance.passes,
    };
    Ok(Finished { solution, counters })
}

/// Radiosities of what is not a row: dark, but for the unshaded soil beyond the map of an open scene and
/// the far field's start.
fn fixed(problem: &Problem, world: &World, plan: &Plan) -> Vec<f64> {
    let bands = problem.bands.len();
    let mut fixed = vec![0.0; (world.ends.len() - world.rows()) * bands];
    let at = |end: u32| (end - world.ends.rows()) as usize * bands;
    if world.soil.is_some() && !world.extent.periodic {
        for b in 0..bands {
            fixed[at(world.ends.outer_soil()) + b] = outer_soil_radiosity_W_m2(problem, b);
        }
    }
    if let Some(resolution) = &plan.far_field {
        fixed[at(world.ends.far_start())..]
            .copy_from_slice(&from_layers(problem, world, resolution));
    }
    fixed
}
