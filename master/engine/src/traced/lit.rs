//! Lights a traced canopy: direct light, the solution, its account of errors, its sensors.

use std::borrow::Cow;
use std::mem;

use nestrad_common::light::Sources;
use nestrad_common::optics::Optics;
use nestrad_common::sensors::Sensor;
use nestrad_kernel::rows::Counts;
use serde::Serialize;

use super::canopy::TracedCanopy;
use super::scattering::Scattering;
use crate::account::Accounting;
use crate::assemble::Parts;
use crate::direct::{Direct, KeptDirections, direct_light_keeping};
use crate::exchange::{JobCounts, Outlook, RowSource};
use crate::far_field::start::fixed_radiosity_W_m2;
use crate::frame::Frame;
use crate::lit_canopy::LitCanopy;
use crate::outer_soil;
use crate::plan::{LightPlan, Plan};
use crate::run::Run;
use crate::sensors::Surroundings;
use crate::solution::Solution;
use crate::solve_error::SolveError;
use crate::solver::{FarSample, Irradiance, System, solve as solve_system};
use crate::stopwatch::Stopwatch;

/// The name of a stage whose time a budget is reckoned by.
pub(crate) const STAGE_DIRECT_LIGHT: &str = "direct light";

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

    /// The irradiances of all rows with what is scattered. Adds to the soil around the map what it sends back.
    fn scattered(
        &self,
        frame: &Frame,
        (scattering, outlook): (&Scattering, &Outlook),
        direct: &Direct,
        outer_soil_W_m2: &mut [f64],
        run: &Run,
    ) -> Result<Irradiance, SolveError> {
        let (optics, plan) = (&self.optics, self.plan);
        let reaches = |row| direct.reaches(row);
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
                outlook,
                groups: &scattering.groups,
                far: far.map(|far| &far.rows),
                direct_W_m2: &direct.irradiance_W_m2,
                fixed_W_m2: &fixed_radiosity_W_m2(frame, optics, self.sources, outer_soil_W_m2),
                incoming_W: &direct.incoming_W,
                far_sample: sample,
            };
            solve_system(&system, &plan.scattering_bands, &plan.tolerance, run.stop)
        };
        let mut irradiance = solved(outer_soil_W_m2)?;
        let sent_back = outer_soil::sent_back_W_m2(
            (frame, optics),
            (&scattering.exchange, outlook),
            (&irradiance, &plan.scattering_bands),
            &direct.incoming_W,
        );
        if let Some(sent_back) = sent_back {
            for (sum, back) in outer_soil_W_m2.iter_mut().zip(&sent_back) {
                *sum += back;
            }
            // there is memory for one solution at a time
            let passes = mem::take(&mut irradiance).passes;
            irradiance = solved(outer_soil_W_m2)?;
            irradiance.passes += passes;
        }
        Ok(irradiance)
    }
}

impl TracedCanopy {
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
        let (outlook, irradiance) = match &self.scattering {
            Some(scattering) => {
                run.progress.stage("solve", 0);
                let reaches = |row| direct.reaches(row);
                let outlook = scattering.outlook.lit(frame, reaches);
                let means = (scattering, &*outlook);
                let irradiance =
                    light.scattered(frame, means, direct, &mut outer_soil_W_m2, run)?;
                watch.lap("solve");
                run.stop.check()?;
                (outlook, irradiance)
            }
            None => (Cow::Borrowed(&dark), Irradiance::default()),
        };
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
