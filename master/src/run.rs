//! A solve from beginning to end.

use std::panic::resume_unwind;

use nestrad_common::problem::Problem;
use thiserror::Error;

use crate::cluster::Cluster;
use crate::direct::{Direct, DirectError, direct_light};
use crate::errors::{ErrorParts, OrganParts};
use crate::exchange::{
    BlockOf, Exchange, ExchangeError, JobCounts, Outlook, Sampling, Traced, trace_here, trace_kept,
};
use crate::far_field::closure::{FarRows, from_layers};
use crate::order::Ordered;
use crate::output::progress::{Cancelled, Progress};
use crate::output::resources::Stopwatch;
use crate::plan::Plan;
use crate::results::Parts;
use crate::solution::Solution;
use crate::solver::{FarSample, Irradiance, SolveError, System};
use crate::store::Store;
use crate::world::{World, outer_soil_radiosity_W_m2};

/// What a solve gives, and what it took.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The results.
    pub solution: Solution,
    /// How much was computed.
    pub counters: Counters,
    /// What the errors of organs come from, by band.
    pub errors: Vec<ErrorParts>,
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
    /// Jobs of the exchange.
    pub jobs: JobCounts,
    /// Passes of the solver over all rows.
    pub passes: u32,
}

/// Why a solve failed.
#[derive(Debug, Error)]
pub enum RunError {
    /// Direct light could not be computed.
    #[error(transparent)]
    Direct(#[from] DirectError),
    /// The exchange could not be computed.
    #[error(transparent)]
    Exchange(#[from] ExchangeError),
    /// The solver did not converge.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// Light is lost or gained, far beyond what the sampling leaves uncertain.
    #[error(
        "the energy balance of band {band} does not close: {:.1} % of the incoming light is unaccounted for, where sampling leaves {:.1} % uncertain: faces of very different size see each other by too few lines, expected a finer --accuracy or a scene whose parts are nearer in size",
        100.0 * missing,
        100.0 * stated
    )]
    Unbalanced {
        /// Name of the band.
        band: String,
        /// What is missing, in parts of the incoming light.
        missing: f64,
        /// Its standard error.
        stated: f64,
    },
    /// It is not wanted any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Part of the incoming light that may be missing, whatever is stated of it.
const MAY_BE_MISSING: f64 = 0.05;

/// Standard errors that a balance may be off by.
const MAY_BE_OFF: f64 = 5.0;

/// A leaf beside a face ten thousand times as large is seen from it by hardly a line, and what it sends there
/// can go missing without a trace in the stated errors; but not in the balance.
fn check_balance(solution: &Solution) -> Result<(), RunError> {
    for balance in &solution.balance {
        let part = |watts: f64| watts / balance.incoming_W.max(f64::MIN_POSITIVE);
        let (missing, stated) = (part(balance.closure_W.value), part(balance.closure_W.se));
        if missing.abs() > MAY_BE_MISSING + MAY_BE_OFF * stated {
            return Err(RunError::Unbalanced {
                band: balance.band.clone(),
                missing,
                stated,
            });
        }
    }
    Ok(())
}

/// What a solve may use besides this process.
#[derive(Clone, Copy, Default)]
pub struct Means<'a> {
    /// Workers that trace the exchange; without them it is traced here.
    pub workers: Option<&'a Cluster>,
    /// Results of jobs that are kept from solve to solve.
    pub kept: Option<&'a Store>,
}

/// Solves a problem as planned in this process, or stops at the end of a step (a source, a batch, a pass) if
/// `progress` is told so.
pub fn solve(
    problem: &Problem,
    plan: &Plan,
    progress: &Progress,
    watch: &mut Stopwatch,
) -> Result<Finished, RunError> {
    solve_with(problem, plan, Means::default(), progress, watch)
}

/// Solves a problem as planned. While workers trace, direct light and far field are computed here.
pub fn solve_with(
    problem: &Problem,
    plan: &Plan,
    means: Means,
    progress: &Progress,
    watch: &mut Stopwatch,
) -> Result<Finished, RunError> {
    let ordered = Ordered::of(problem);
    let problem = &ordered.problem;
    let world = plan.world(problem);
    watch.lap("elements");
    progress.check()?;
    let (exchange, meanwhile) = std::thread::scope(|scope| {
        let tracing = plan.sampling.as_ref().zip(means.workers);
        let tracing = tracing.map(|(sampling, workers)| {
            let world = &world;
            scope
                .spawn(move || workers.trace(&problem.scene, world, sampling, means.kept, progress))
        });
        // the stage that is shown is the workers', where there are any
        let shown = tracing.is_none();
        let meanwhile = Meanwhile::compute(problem, plan, &world, (progress, shown), watch);
        if meanwhile.is_err() {
            // the workers need not go on
            progress.cancel();
        }
        let exchange = match (tracing, &plan.sampling) {
            (Some(tracing), _) => tracing.join().unwrap_or_else(|panic| resume_unwind(panic)),
            (None, Some(sampling)) if meanwhile.is_ok() => {
                here(problem, &world, sampling, means.kept, progress)
            }
            _ => Ok(Exchange::default()),
        };
        watch.lap("exchange");
        (exchange, meanwhile)
    });
    let (meanwhile, exchange) = (meanwhile?, exchange?);
    let direct = &meanwhile.direct;

    let mut outlook = Outlook::default();
    let mut irradiance = Irradiance::default();
    if plan.sampling.is_some() {
        progress.stage("solve", 0);
        outlook = exchange.outlook(&world, |row| direct.reaches(row));
        let system = System {
            problem,
            world: &world,
            exchange: &exchange,
            outlook: &outlook,
            far: meanwhile.far.as_ref(),
            direct_W_m2: &direct.irradiance_W_m2,
            fixed_W_m2: &meanwhile.fixed_W_m2,
            incoming_W: &direct.incoming_W,
            far_sample: meanwhile.far_sample.as_ref(),
        };
        irradiance = system.solve(&plan.scattering_bands, &plan.tolerance, &|| {
            progress.check()
        })?;
        watch.lap("solve");
        progress.check()?;
    }
    progress.stage("results", 0);
    let parts = Parts {
        problem,
        world: &world,
        direct,
        outlook: &outlook,
        irradiance: &irradiance,
        scattering: &plan.scattering_bands,
    };
    let mut solution = parts.assemble();
    let organs = OrganParts::of(direct, &irradiance, &plan.scattering_bands);
    let errors = organs.of_scene(&problem.scene, &solution);
    solution.organ_bias_W = organs.bias_W(&solution);
    let solution = ordered.back(solution);
    check_balance(&solution)?;
    watch.lap("results");
    progress.finish();
    let counters = Counters {
        elements: world.elements.len(),
        direct_lines: direct.lines,
        exchange: exchange.counters,
        jobs: exchange.jobs,
        passes: irradiance.passes,
    };
    Ok(Finished {
        solution,
        counters,
        errors,
    })
}

/// The exchange, traced in this process.
fn here(
    problem: &Problem,
    world: &World,
    sampling: &Sampling,
    kept: Option<&Store>,
    progress: &Progress,
) -> Result<Exchange, ExchangeError> {
    if let Some(kept) = kept {
        return trace_kept(&problem.scene, world, sampling, kept, progress);
    }
    progress.stage("exchange", u64::from(sampling.batches));
    let whole = [BlockOf::whole(world)];
    trace_here(&problem.scene, world, &whole, sampling, || {
        progress.inc(1);
        progress.check()
    })
}

/// What is computed while workers trace.
struct Meanwhile {
    direct: Direct,
    far: Option<FarRows>,
    far_sample: Option<FarSample>,
    fixed_W_m2: Vec<f64>,
}

impl Meanwhile {
    fn compute(
        problem: &Problem,
        plan: &Plan,
        world: &World,
        (progress, shown): (&Progress, bool),
        watch: &mut Stopwatch,
    ) -> Result<Self, RunError> {
        let stage = |name: &str, steps: usize| {
            if shown {
                progress.stage(name, steps as u64);
            }
        };
        stage("direct light", problem.sources.len());
        let areas_m2 = plan.direct_line_areas_m2(problem);
        let direct = direct_light(problem, world, &areas_m2, plan.seed, || {
            if shown {
                progress.inc(1);
            }
            progress.check()
        })?;
        watch.lap("direct light");
        let (mut far, mut far_sample, mut fixed_W_m2) = (None, None, Vec::new());
        if let Some(sampling) = &plan.sampling {
            stage("far field", 0);
            let rows = plan.far_field.map(|f| FarRows::trace(problem, world, &f));
            far = rows.transpose().map_err(ExchangeError::from)?;
            fixed_W_m2 = fixed(problem, world, plan);
            if far.is_some() {
                let lit = |row| direct.reaches(row);
                far_sample = Some(sample_far(problem, world, sampling, lit, progress)?);
            }
            watch.lap("far field");
            progress.check()?;
        }
        Ok(Self {
            direct,
            far,
            far_sample,
            fixed_W_m2,
        })
    }
}

/// The exchange by a few lines, within the sphere and without end: what the far field is judged by.
fn sample_far(
    problem: &Problem,
    world: &World,
    sampling: &Sampling,
    lit: impl Fn(usize) -> bool + Sync,
    progress: &Progress,
) -> Result<FarSample, ExchangeError> {
    let few = sampling.glance();
    let look = |radius_m: f64| {
        let world = World {
            radius_m,
            ..world.clone()
        };
        let whole = [BlockOf::whole(&world)];
        let seen = trace_here(&problem.scene, &world, &whole, &few, || progress.check())?;
        let outlook = seen.outlook(&world, &lit);
        Ok::<_, ExchangeError>((seen, outlook))
    };
    Ok(FarSample {
        within: look(world.radius_m)?,
        without_end: look(f64::INFINITY)?,
    })
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
