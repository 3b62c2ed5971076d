//! A canopy that was traced: it knows no light, and is lit again and again.
//!
//! What depends on the geometry alone (elements, rows of the exchange, lines of the far field) is computed once and
//! shared; what depends on light and optics (direct light, the solution, its account of errors) is computed by
//! [`TracedCanopy::lit`].

use std::borrow::Cow;
use std::panic::resume_unwind;
use std::thread;

use nestrad_common::canopy::Canopy;
use nestrad_common::light::Sources;
use nestrad_common::optics::Optics;
use nestrad_common::sensors::Sensor;
use nestrad_kernel::rows::Counts;
use serde::Serialize;

use crate::account::Accounting;
use crate::assemble::Parts;
use crate::direct::{Direct, KeptDirections, direct_light_keeping};
use crate::exchange::{
    Exchange, ExchangeError, FarRows, JobCounts, Outlook, RowSource, ThisProcess,
};
use crate::far_field::start::fixed_radiosity_W_m2;
use crate::frame::Frame;
use crate::heap::Freed;
use crate::lit_canopy::LitCanopy;
use crate::outer_soil;
use crate::plan::{LightPlan, Plan, TracePlan};
use crate::progress::Progress;
use crate::run::Run;
use crate::sensors::Surroundings;
use crate::solution::Solution;
pub use crate::solve_error::{FailureKind, SolveError};
use crate::solver::{FarSample, Groups, Irradiance, Sampled, System, solve as solve_system};
use crate::stopwatch::Stopwatch;

/// A canopy in its frame, with what its faces see of each other.
pub struct TracedCanopy {
    frame: Frame,
    scattering: Option<Scattering>,
    /// What directions lighted it so far.
    directions: KeptDirections,
}

/// What light that is scattered goes by; not there where nothing was to be scattered.
struct Scattering {
    exchange: Exchange,
    outlook: Outlook,
    groups: Groups,
    far: Option<Far>,
}

/// The far field, and what it is judged by.
struct Far {
    rows: FarRows,
    within: Look,
    without_end: Look,
}

/// The exchange by a few lines.
struct Look {
    exchange: Exchange,
    outlook: Outlook,
}

/// How much was computed.
#[derive(Clone, Debug, Default, Serialize)]
pub struct WorkDone {
    /// Parallel sources that it was lit by.
    pub sources: usize,
    /// Elements that triangles were cut into.
    pub elements: usize,
    /// Lattice points of the direct light.
    pub direct_lines: u64,
    /// Lines, segments, rays and row entries of the exchange.
    pub exchange: Counts,
    /// Jobs of the exchange.
    pub jobs: JobCounts,
    /// Passes of the solver over all rows.
    pub passes: u32,
}

/// Names of the stages whose time a budget is reckoned by.
pub(crate) const STAGE_EXCHANGE: &str = "exchange";
pub(crate) const STAGE_DIRECT_LIGHT: &str = "direct light";

impl TracedCanopy {
    /// Traces a canopy as planned.
    pub fn trace(
        canopy: &Canopy,
        plan: &TracePlan,
        rows: &dyn RowSource,
        run: &Run,
    ) -> Result<Self, SolveError> {
        Self::trace_frame(Frame::new(canopy, &plan.cut())?, plan, rows, run)
    }

    /// Traces a canopy in a frame that was made for it.
    pub fn trace_frame(
        frame: Frame,
        plan: &TracePlan,
        rows: &dyn RowSource,
        run: &Run,
    ) -> Result<Self, SolveError> {
        let watch = &mut Stopwatch::start();
        let (traced, ()) = Self::of_frame(frame, plan, (rows, run, watch), |_, _, _| Ok(()))?;
        Ok(traced)
    }

    /// Traces a canopy in its frame. Where rows are traced elsewhere, this process does `meanwhile` at the same
    /// time, else before; it has a frame, and is watched.
    pub fn of_frame<T>(
        frame: Frame,
        plan: &TracePlan,
        (rows, run, watch): (&dyn RowSource, &Run, &mut Stopwatch),
        meanwhile: impl FnOnce(&Frame, &Run, &mut Stopwatch) -> Result<T, SolveError>,
    ) -> Result<(Self, T), SolveError> {
        let here = |run: &Run, watch: &mut Stopwatch| {
            let done = meanwhile(&frame, run, watch)?;
            let far = Far::trace(&frame, plan, run)?;
            if plan.sampling.is_some() {
                watch.lap("far field");
            }
            Ok((done, far))
        };
        let there = |run: &Run| match &plan.sampling {
            Some(sampling) => Ok(Some(Exchange::trace(&frame, sampling, rows, run)?)),
            None => Ok(None),
        };
        let is_elsewhere = rows.is_elsewhere() && plan.sampling.is_some() && !plan.in_turn;
        let ((done, far), exchange) = if is_elsewhere {
            at_once(run, |run| here(run, watch), there)?
        } else {
            (here(run, watch)?, there(run)?)
        };
        if frame.rows() > MANY_ROWS {
            Freed::default().give_back();
        }
        let scattering = exchange.map(|exchange| Scattering {
            outlook: Outlook::of(&frame, &exchange),
            exchange,
            groups: Groups::of(&frame),
            far,
        });
        watch.lap(STAGE_EXCHANGE);
        let traced = Self {
            frame,
            scattering,
            directions: KeptDirections::default(),
        };
        Ok((traced, done))
    }

    /// The same with what directions light it by.
    pub(crate) fn keeping(mut self, directions: KeptDirections) -> Self {
        self.directions = directions;
        self
    }

    /// Bytes that it takes, with the directions that are kept.
    pub fn bytes(&self) -> u64 {
        let scattering = self.scattering.as_ref().map_or(0, Scattering::bytes);
        self.frame.bytes() + scattering + self.directions.bytes()
    }

    /// The canopy in its frame.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// What its faces see of each other; none where nothing was to be scattered.
    pub fn exchange(&self) -> Option<&Exchange> {
        self.scattering.as_ref().map(|s| &s.exchange)
    }

    /// Lights it: direct light, scattered light, and the account of their errors.
    pub fn lit(
        &self,
        optics: &Optics,
        sources: &Sources,
        plan: &LightPlan,
        run: &Run,
    ) -> Result<(Solution, WorkDone), SolveError> {
        self.lit_watched(optics, (sources, &[]), plan, run, &mut Stopwatch::start())
    }

    /// The same with sensors, watched.
    pub(crate) fn lit_watched(
        &self,
        optics: &Optics,
        (sources, sensors): (&Sources, &[Sensor]),
        plan: &LightPlan,
        run: &Run,
        watch: &mut Stopwatch,
    ) -> Result<(Solution, WorkDone), SolveError> {
        let light = FramedLight::of(&self.frame, optics, (sources, sensors), plan);
        let direct = light.direct(&self.frame, &self.directions, run, watch)?;
        self.solve(&light, &direct, run, watch)
    }

    /// What follows from the direct light.
    fn solve(
        &self,
        light: &FramedLight,
        direct: &Direct,
        run: &Run,
        watch: &mut Stopwatch,
    ) -> Result<(Solution, WorkDone), SolveError> {
        let (frame, optics, plan) = (&self.frame, &light.optics, light.plan);
        let mut outer_soil_W_m2 = outer_soil::radiosity_W_m2(frame, optics, light.sources, direct);
        let dark = Outlook::default();
        let mut outlook = Cow::Borrowed(&dark);
        let mut irradiance = Irradiance::default();
        if let Some(scattering) = &self.scattering {
            run.progress.stage("solve", 0);
            let reaches = |row| direct.reaches(row);
            outlook = scattering.outlook.lit(frame, reaches);
            let far = scattering.far.as_ref();
            let looks = far.map(|far| [&far.within, &far.without_end]);
            let lit = looks.map(|looks| looks.map(|look| look.outlook.lit(frame, reaches)));
            let sample = looks.zip(lit.as_ref()).map(|(looks, lit)| FarSample {
                within: looks[0].sampled(&lit[0]),
                without_end: looks[1].sampled(&lit[1]),
            });
            let solved = |outer_soil_W_m2: &[f64]| {
                let system = System {
                    frame,
                    optics,
                    exchange: &scattering.exchange,
                    outlook: &outlook,
                    groups: &scattering.groups,
                    far: far.map(|far| &far.rows),
                    direct_W_m2: &direct.irradiance_W_m2,
                    fixed_W_m2: &fixed_radiosity_W_m2(
                        frame,
                        optics,
                        light.sources,
                        outer_soil_W_m2,
                    ),
                    incoming_W: &direct.incoming_W,
                    far_sample: sample,
                };
                solve_system(&system, &plan.scattering_bands, &plan.tolerance, run.stop)
            };
            irradiance = solved(&outer_soil_W_m2)?;
            let sent_back = outer_soil::sent_back_W_m2(
                (frame, optics),
                (&scattering.exchange, &outlook),
                (&irradiance, &plan.scattering_bands),
                &direct.incoming_W,
            );
            if let Some(sent_back) = sent_back {
                for (sum, back) in outer_soil_W_m2.iter_mut().zip(&sent_back) {
                    *sum += back;
                }
                let passes = irradiance.passes;
                irradiance = solved(&outer_soil_W_m2)?;
                irradiance.passes += passes;
            }
            watch.lap("solve");
            run.stop.check()?;
        }
        run.progress.stage("results", 0);
        let parts = Parts {
            frame,
            optics,
            direct,
            outer_soil_W_m2: &outer_soil_W_m2,
            outlook: &outlook,
            irradiance: &irradiance,
            scattering: &plan.scattering_bands,
        };
        let mut solution = parts.assemble();
        let accounting = Accounting::of(direct, &irradiance, &plan.scattering_bands);
        solution.account = accounting.of_bands(&frame.plants(), &solution);
        solution.organ_bias_W = accounting.bias_W(&solution);
        let exchange = self.exchange();
        let work = WorkDone {
            sources: light.sources.list.len(),
            elements: frame.area_m2.len(),
            direct_lines: direct.lines,
            exchange: exchange.map_or_else(Counts::default, |e| e.counts),
            jobs: exchange.map_or_else(JobCounts::default, |e| e.jobs),
            passes: irradiance.passes,
        };
        let surroundings = Surroundings {
            frame,
            optics,
            sources: light.sources,
            direct,
            irradiance: &irradiance,
            scattering: &plan.scattering_bands,
            groups: self.scattering.as_ref().map(|s| &s.groups),
            outlook: &outlook,
            outer_soil_W_m2: &outer_soil_W_m2,
            seed: plan.seed,
        };
        let readings = surroundings.readings(light.sensors, run)?;
        drop(irradiance);
        let mut solution = solution.in_order_of(&frame.order);
        solution.readings = readings;
        check_balance(&solution)?;
        watch.lap("results");
        run.progress.finish();
        Ok((solution, work))
    }
}

/// A light, and the optics of the canopy in its frame.
struct FramedLight<'a> {
    optics: Optics,
    sources: &'a Sources,
    sensors: &'a [Sensor],
    plan: &'a LightPlan,
}

impl<'a> FramedLight<'a> {
    fn of(
        frame: &Frame,
        optics: &Optics,
        (sources, sensors): (&'a Sources, &'a [Sensor]),
        plan: &'a LightPlan,
    ) -> Self {
        Self {
            optics: frame.ordered(optics),
            sources,
            sensors,
            plan,
        }
    }

    fn direct(
        &self,
        frame: &Frame,
        kept: &KeptDirections,
        run: &Run,
        watch: &mut Stopwatch,
    ) -> Result<Direct, SolveError> {
        let sources = self.sources;
        run.progress
            .stage("direct light", sources.list.len() as u64);
        let line_areas_m2 = self.plan.line_areas_m2(&frame.world.extent, sources);
        let projections = (sources, &line_areas_m2[..]);
        let step = || {
            run.progress.inc(1);
            run.stop.check()
        };
        let seed = self.plan.seed;
        let direct = direct_light_keeping(frame, &self.optics, projections, seed, kept, step)?;
        watch.lap(STAGE_DIRECT_LIGHT);
        Ok(direct)
    }
}

/// Traces a lit canopy and lights it, as planned: with a row source elsewhere, direct light and far field are
/// computed here meanwhile.
pub fn solve(
    lit: &LitCanopy,
    plan: &Plan,
    rows: &dyn RowSource,
    run: &Run,
    watch: &mut Stopwatch,
) -> Result<(Solution, WorkDone), SolveError> {
    let directions = KeptDirections::default();
    let (solution, work, _) = solve_and_keep(lit, plan, (rows, run, watch), directions)?;
    Ok((solution, work))
}

/// The same; the canopy stays, with the directions that there is room for.
pub(crate) fn solve_and_keep(
    lit: &LitCanopy,
    plan: &Plan,
    (rows, run, watch): (&dyn RowSource, &Run, &mut Stopwatch),
    directions: KeptDirections,
) -> Result<(Solution, WorkDone, TracedCanopy), SolveError> {
    let frame = Frame::new(lit.canopy, &plan.trace.cut())?;
    watch.lap("elements");
    run.stop.check()?;
    let light = FramedLight::of(&frame, lit.optics, (lit.sources, lit.sensors), &plan.light);
    let direct = |frame: &Frame, run: &Run, watch: &mut Stopwatch| {
        light.direct(frame, &directions, run, watch)
    };
    let means = (rows, run, &mut *watch);
    let (traced, direct) = TracedCanopy::of_frame(frame, &plan.trace, means, direct)?;
    let traced = traced.keeping(directions);
    let (solution, work) = traced.solve(&light, &direct, run, watch)?;
    Ok((solution, work, traced))
}

/// Does one thing here and another on a thread of its own, which is not counted. Where one fails, the other is
/// stopped, and the failure keeps its cause.
fn at_once<A, B: Send>(
    run: &Run,
    here: impl FnOnce(&Run) -> Result<A, SolveError>,
    there: impl FnOnce(&Run) -> Result<B, SolveError> + Send,
) -> Result<(A, B), SolveError> {
    let stop = run.stop.part();
    let uncounted = Progress::default();
    let (here, there) = thread::scope(|scope| {
        let there = scope.spawn(|| {
            let run = Run {
                stop: &stop,
                ..*run
            };
            there(&run).inspect_err(|_| stop.stop())
        });
        let run = Run {
            stop: &stop,
            progress: &uncounted,
        };
        let here = here(&run).inspect_err(|_| stop.stop());
        (
            here,
            there.join().unwrap_or_else(|panic| resume_unwind(panic)),
        )
    });
    match (here, there) {
        (Ok(here), Ok(there)) => Ok((here, there)),
        (Err(SolveError::Stopped(_)), Err(error)) | (Err(error), _) | (_, Err(error)) => Err(error),
    }
}

impl Scattering {
    fn bytes(&self) -> u64 {
        let looks = self
            .far
            .iter()
            .flat_map(|far| [&far.within, &far.without_end]);
        let looks = looks.map(|look| look.exchange.bytes() + look.outlook.bytes());
        let far = self.far.as_ref().map_or(0, |far| far.rows.bytes());
        let own = self.exchange.bytes() + self.outlook.bytes() + self.groups.bytes();
        own + far + looks.sum::<u64>()
    }
}

impl Far {
    /// What stands for all beyond the sphere, where there is one.
    fn trace(frame: &Frame, plan: &TracePlan, run: &Run) -> Result<Option<Self>, SolveError> {
        let Some((far, sampling)) = plan.far_field.zip(plan.sampling) else {
            return Ok(None);
        };
        let rows = FarRows::trace(frame, &far.sampling, run.stop)?;
        // by a few lines, within the sphere and without end
        let few = sampling.glance();
        let uncounted = Progress::default();
        let run = Run {
            progress: &uncounted,
            ..*run
        };
        let look = |rows: ThisProcess| {
            let exchange = Exchange::trace(frame, &few, &rows, &run)?;
            let outlook = Outlook::of(frame, &exchange);
            Ok::<_, ExchangeError>(Look { exchange, outlook })
        };
        Ok(Some(Self {
            rows,
            within: look(ThisProcess::default())?,
            without_end: look(ThisProcess::without_end())?,
        }))
    }
}

impl Look {
    fn sampled<'a>(&'a self, outlook: &'a Outlook) -> Sampled<'a> {
        Sampled {
            exchange: &self.exchange,
            outlook,
        }
    }
}

/// With more rows than this, memory that tracing has freed is given back before the solver takes its own: 280 MB of
/// 2.8 GB for a million triangles. It takes milliseconds, which a small canopy does not.
const MANY_ROWS: usize = 100_000;

/// Part of the incoming light that may be missing, whatever is stated of it.
const MAY_BE_MISSING: f64 = 0.05;

/// Standard errors that a balance may be off by.
const MAY_BE_OFF: f64 = 5.0;

/// A leaf beside a face ten thousand times as large is seen from it by hardly a line, and what it sends there
/// can go missing without a trace in the stated errors; but not in the balance.
fn check_balance(solution: &Solution) -> Result<(), SolveError> {
    for balance in &solution.balance {
        let part = |watts: f64| watts / balance.incoming_W.max(f64::MIN_POSITIVE);
        let (missing, stated) = (part(balance.closure_W.value), part(balance.closure_W.se));
        if missing.abs() > MAY_BE_MISSING + MAY_BE_OFF * stated {
            return Err(SolveError::Unbalanced {
                band: balance.band.clone(),
                missing,
                stated,
            });
        }
    }
    Ok(())
}
