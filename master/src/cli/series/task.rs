//! The work of a series: weather to light, the canopy traced once, every moment lit, tables written.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result};
use nestrad_common::assemble::{Unlit, load_unlit};
use nestrad_common::formats::weather::Weather;
use nestrad_common::inputs::Inputs;
use nestrad_common::light::SkyModel;
use nestrad_common::scene::Scene;
use nestrad_common::weather::{Moment, Site, ToLight};
use nestrad_engine::exchange::ThisProcess;
use nestrad_engine::plan::{Plan, Settings};
use nestrad_engine::progress::Progress;
use nestrad_engine::rounds::{Ended, Round, Solved};
use nestrad_engine::run::Run;
use nestrad_engine::series::Series;
use nestrad_engine::stop::Stop;
use nestrad_engine::stopwatch::Stopwatch;
use nestrad_results::series::{
    Part, SeriesResult, SeriesSummary, SeriesTime, StepResult, check_place, key, write,
};
use thiserror::Error;

use super::pace::Pace;
use super::record::SeriesRecord;
use super::source::Source;
use super::sums::{sums, table};
use crate::cli::bar::Bar;
use crate::cli::console::Notes;
use crate::cli::flags::misuse;

/// All that the user said.
pub(super) struct Task {
    pub(super) inputs: Inputs,
    pub(super) settings: Settings,
    pub(super) weather: Weather,
    pub(super) source: Source,
    pub(super) place: Site,
    pub(super) sky: SkyModel,
    pub(super) out: PathBuf,
    pub(super) notes: Notes,
}

/// The moments of a series take more memory than allowed.
#[derive(Debug, Error)]
#[error(
    "{moments} moments of {organs} organs in {bands} bands take {needed_GiB:.2} GiB, expected at most half of --memory, \
     {limit_GiB} GiB: allow more with --memory, or give the weather in parts"
)]
pub(crate) struct SeriesMemory {
    moments: usize,
    organs: usize,
    bands: usize,
    needed_GiB: f64,
    limit_GiB: f64,
}

/// Odd things about the light of rows are said for so many of them.
const MOST_WARNINGS: usize = 3;

const INTEGRATION: &str =
    "trapezoidal rule over the rows of the weather; nights that are not in it count as rows of 0";

impl Task {
    pub(super) fn carry_out(&self) -> Result<()> {
        let mut watch = Stopwatch::start();
        // before the work, not after it
        check_place(&self.out)?;
        let bands: Vec<String> = self.inputs.bands.iter().map(|b| b.name.clone()).collect();
        let to_light = ToLight {
            site: self.place,
            sky: self.sky,
            bands: &bands,
            band_fraction: &self.inputs.band_fraction,
        };
        let moments = to_light.moments(&self.weather)?;
        let reference = brightest(&moments).ok_or_else(|| {
            misuse("there is no light at any moment: expected a row with light in some band")
        })?;
        let unlit = load_unlit(&self.inputs)?;
        self.warn(&unlit, &moments);
        let settings = self.shared_memory(&unlit, &moments)?;
        watch.lap("input");
        let parts: [&dyn std::fmt::Debug; 5] = [
            &env!("CARGO_PKG_VERSION"),
            &*unlit.canopy,
            &*unlit.optics,
            &settings,
            &moments,
        ];
        let (mut part, done) = Part::open(&self.out, key(&parts))?;
        let mut steps: Vec<Option<StepResult>> = vec![None; moments.len()];
        let items = unlit.canopy.organs.len() * bands.len();
        let fits = |number: &usize, step: &StepResult| {
            moments
                .get(*number)
                .is_some_and(|moment| moment.light.is_some())
                && step.organs.len() == items
                && step.facts.balance.len() == bands.len()
        };
        for (number, step) in done.into_iter().filter(|(number, step)| fits(number, step)) {
            steps[number] = Some(step);
        }
        let lit = moments
            .iter()
            .filter(|moment| moment.light.is_some())
            .count();
        let known = steps.iter().flatten().count();
        if known > 0 {
            let line = format!("{known} of {lit} moments are done already: going on");
            self.notes.say("series", &line);
        }
        watch.lap("kept moments");

        let progress = Arc::new(Progress::default());
        let bar = Bar::of(&progress, self.notes.quiet);
        let run = Run {
            stop: &Stop::default(),
            progress: &progress,
        };
        let rows = ThisProcess::default();
        let scene = Scene {
            canopy: unlit.canopy.clone(),
            optics: unlit.optics.clone(),
            light: Arc::new(reference.light.clone().unwrap_or_default()),
        };
        let begins = |plan: &Plan, before: &[Round]| self.begins(plan, before);
        let begun = Series::begin(scene, settings, &rows, &run, &mut watch, begins);
        let (mut series, chosen) = begun?;
        if chosen.accuracy.ended == Ended::Failed {
            let why = chosen.accuracy.failure.as_deref().unwrap_or_default();
            let line =
                format!("a finer round failed ({why}): the one before it serves all moments");
            self.notes.say("warning", &line);
        }
        watch.lap("choice");
        let mut pace = Pace::new(lit - known);
        for (number, moment) in moments.iter().enumerate() {
            let (Some(light), None) = (&moment.light, &steps[number]) else {
                continue;
            };
            let solved = series.lit(light, &rows, &run, &mut Stopwatch::start());
            let place = || {
                format!(
                    "{}, line {} ({})",
                    self.weather.file, moment.line, moment.time
                )
            };
            let (solution, _) = solved.with_context(place)?;
            let step = StepResult::of(&solution);
            part.add(number, &step)?;
            steps[number] = Some(step);
            if let Some(line) = pace.one_more() {
                self.notes.say("series", &line);
            }
        }
        drop(bar);
        watch.lap("moments");
        let areas = &chosen.solution.organ_area_m2;
        self.write(
            (&moments, reference),
            &unlit,
            (&steps, areas),
            &chosen,
            &watch,
        )?;
        part.remove()?;
        Ok(())
    }

    /// Says what is odd about the scene, about the columns of the weather, and about the light of some rows.
    fn warn(&self, unlit: &Unlit, moments: &[Moment]) {
        for warning in &unlit.inspection.warnings {
            self.notes.say("warning", warning);
        }
        if !self.weather.unused.is_empty() {
            let names = self.weather.unused.join(", ");
            let line = format!("{}: columns that are not used: {names}", self.weather.file);
            self.notes.say("weather", &line);
        }
        let names = unlit.optics.names();
        let odd = moments.iter().flat_map(|moment| {
            let warnings = moment.light.iter().flat_map(|light| light.warnings(&names));
            warnings.map(|warning| format!("{} ({}): {warning}", self.weather.file, moment.time))
        });
        let mut odd = odd.collect::<Vec<_>>();
        let more = odd.len().saturating_sub(MOST_WARNINGS);
        odd.truncate(MOST_WARNINGS);
        for warning in &odd {
            self.notes.say("warning", warning);
        }
        if more > 0 {
            let line = format!("{more} more rows have such a warning");
            self.notes.say("warning", &line);
        }
    }

    /// The settings of the canopy, which has the memory that the moments leave it.
    fn shared_memory(&self, unlit: &Unlit, moments: &[Moment]) -> Result<Settings, SeriesMemory> {
        let lit = moments
            .iter()
            .filter(|moment| moment.light.is_some())
            .count();
        let (organs, bands) = (unlit.canopy.organs.len(), unlit.optics.len());
        let bytes = lit as f64 * StepResult::bytes(organs, bands) as f64;
        let needed_GiB = bytes / f64::from(1 << 30);
        let limit_GiB = 0.5 * self.settings.memory_GiB;
        if needed_GiB > limit_GiB {
            return Err(SeriesMemory {
                moments: lit,
                organs,
                bands,
                needed_GiB,
                limit_GiB,
            });
        }
        Ok(Settings {
            memory_GiB: self.settings.memory_GiB - needed_GiB,
            ..self.settings
        })
    }

    /// Says what the next round does.
    fn begins(&self, plan: &Plan, before: &[Round]) {
        if let Some(reached) = before.last().and_then(|round| round.reached_percent) {
            let line = format!("round {} reached {reached:.3} %", before.len());
            self.notes.say("accuracy", &line);
        }
        for line in &plan.reasons {
            self.notes.say("plan", line);
        }
    }

    fn write(
        &self,
        (moments, reference): (&[Moment], &Moment),
        unlit: &Unlit,
        (steps, organ_area_m2): (&[Option<StepResult>], &[f64]),
        chosen: &Solved,
        watch: &Stopwatch,
    ) -> Result<()> {
        let names = unlit.optics.names();
        let times: Vec<SeriesTime> = moments
            .iter()
            .map(|moment| SeriesTime {
                time: moment.time.clone(),
                sun_elevation_deg: moment.sun.elevation_deg,
                weight_s: moment.weight_s,
            })
            .collect();
        let bands = &self.inputs.bands;
        let photon_umol_J: Vec<Option<f64>> = bands.iter().map(|b| b.photon_umol_J).collect();
        let result = SeriesResult {
            canopy: &unlit.canopy,
            bands: &names,
            photon_umol_J: &photon_umol_J,
            organ_area_m2,
            times: &times,
            steps,
        };
        let sums = sums(&result);
        let errors = steps.iter().flatten();
        let errors: Vec<f64> = errors.filter_map(|step| step.facts.error_percent).collect();
        let asked = self.settings.accuracy_percent;
        let beyond = errors.iter().filter(|&&error| error > asked).count();
        let largest = errors.iter().copied().reduce(f64::max);
        let plan = serde_json::json!({
            "chosen_by": reference.time,
            "plan": chosen.plan_record(),
        });
        write(
            &self.out,
            &result,
            self.inputs.options.format.unwrap_or_default(),
            &SeriesSummary {
                version: env!("CARGO_PKG_VERSION"),
                options: &SeriesRecord::of(
                    &self.inputs,
                    &self.settings,
                    (&self.source, self.sky, self.place),
                ),
                scene: &unlit.inspection,
                plan: &plan,
                moments: moments.len(),
                lit_moments: steps.iter().flatten().count(),
                largest_error_percent: largest,
                moments_beyond_target: beyond,
                integration: INTEGRATION,
                bands: &sums,
                stages: watch.stages(),
                resources: watch.usage(),
            },
        )?;
        if self.notes.quiet {
            return Ok(());
        }
        if let Some(largest) = largest {
            let of = errors.len();
            let line = format!(
                "target {asked} %, {beyond} of {of} moments beyond it, {largest:.3} % at most"
            );
            self.notes.say("accuracy", &line);
        }
        self.notes.show(table(&sums).as_bytes());
        let place = self.out.display();
        self.notes.say("done", &format!("results are in {place}"));
        Ok(())
    }
}

/// The moment that decides how the canopy is traced and how finely its light is computed: the one with the most light in
/// all bands, of those with both sun and sky if there are any.
fn brightest(moments: &[Moment]) -> Option<&Moment> {
    let mut best: Option<((bool, f64), &Moment)> = None;
    for moment in moments {
        let Some(light) = &moment.light else { continue };
        let suns = light.suns.iter().flat_map(|sun| &sun.irradiance_W_m2);
        let sky = light.sky.iter().flat_map(|sky| &sky.irradiance_W_m2);
        let both = !light.suns.is_empty() && light.sky.is_some();
        let rank = (both, suns.chain(sky).sum::<f64>());
        if best.is_none_or(|(known, _)| rank > known) {
            best = Some((rank, moment));
        }
    }
    best.map(|(_, moment)| moment)
}
