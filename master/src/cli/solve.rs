//! `nestrad solve`: files in, light per leaf out.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::{Context, Result};
use clap::{Args, ValueEnum};
use nestrad_cluster::with_rows;
use nestrad_common::assemble::{self, Loaded};
use nestrad_common::inputs::Inputs;
use nestrad_common::inspection::Inspection;
use nestrad_common::options::{Diameter, Options, Scatter, TableFormat};
use nestrad_common::scene::Scene;
use nestrad_engine::account::organ_spread;
use nestrad_engine::plan::{Estimator, Plan, Settings};
use nestrad_engine::progress::Progress;
use nestrad_engine::rounds::{Accuracy, Ended, Round, solve_in_rounds};
use nestrad_engine::run::Run;
use nestrad_engine::stop::Stop;
use nestrad_engine::stopwatch::{Stage, Stopwatch, Usage};
use nestrad_results::summary::Summary;
use nestrad_results::{Formats, check_place, stage, terminal};
use nestrad_service::client::SolvedThere;
use serde::Deserialize;

use super::bar::Bar;
use super::console::Notes;
use super::exit::MissedTarget;
use super::flags::SceneFlags;
use super::numbers::{positive, whole};
use super::pool::pool;
use super::record::OptionsRecord;
use super::remote::MasterFlags;
use super::settings::settings;
use super::state::StateFlags;
use super::workers::{Crew, WorkersFlags};

/// Compute the light that every organ, triangle and soil cell of a canopy gets
///
/// Writes organs.csv, triangles.csv, soil.csv (where there is a soil plane), sensors.csv and radiance.csv (where the scene
/// file has [[sensors]]) and summary.json into DIR; after an error DIR is unchanged. The plan goes to stderr, a table of the energy balance to stdout.
///
/// Exit codes: 0 success; 1 input that cannot be used; 2 wrong flags; 3 results were written, but a fault kept them
/// from the asked accuracy; 4 a limit (memory, time, size, queue) does not allow it; 5 the master cannot be reached,
/// went away, or refuses the caller; 6 an inner fault; 130 cancelled.
#[derive(Debug, Args)]
pub(crate) struct SolveArgs {
    #[command(flatten)]
    scene: SceneFlags,

    #[command(flatten)]
    how: HowFlags,

    #[command(flatten)]
    place: MasterFlags,

    #[command(flatten)]
    workers: WorkersFlags,

    #[command(flatten)]
    state: StateFlags,

    #[command(flatten)]
    results: ResultFlags,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "How to compute it")]
struct HowFlags {
    /// Diameter of the sphere around a leaf in which light is exchanged on the true geometry:
    /// auto, inf or metres [default: auto]
    ///
    /// Beyond it, a multilayer model replaces the geometry. `inf` needs no model; `auto` is `inf` where that
    /// fits --memory. Always in metres.
    #[arg(long, value_name = "auto|inf|METRES", allow_negative_numbers = true)]
    diameter: Option<Diameter>,

    /// Target error, percent, bias included: rms over organs, relative to the canopy's mean [default: 0.5]
    ///
    /// It sets how many lines are traced. With this flag, finer rounds follow until every band meets the
    /// target; without it there is one round, planned for 0.5 %, which may miss it. It also sets how many
    /// directions a built-in sky begins with (1132 at 0.5 %, 476 at 1 %, 200 at 2 %; 4000 at most).
    #[arg(long, value_name = "PERCENT", value_parser = positive, allow_negative_numbers = true)]
    accuracy: Option<f64>,

    /// Longest time of the solve, seconds: it stops with the smallest error that it can reach in that time, and
    /// says which
    ///
    /// A solve that even its coarsest plan cannot do in that time is refused before it starts. Reading and writing
    /// files comes besides. Results then depend on how fast the machine is.
    #[arg(long, value_name = "SECONDS", value_parser = positive, allow_negative_numbers = true)]
    budget: Option<f64>,

    /// Memory that the solve may take, GiB, with its local workers [default: 8]
    ///
    /// Where it is short, the finest plan that fits is carried out, and the plan says what is coarser. A solve that
    /// even its coarsest plan does not fit is refused.
    #[arg(long, value_name = "GIB", value_parser = positive, allow_negative_numbers = true)]
    memory: Option<f64>,

    /// Number of threads, 0 for one per processor, at most 4 for each; results do not depend on it [default: 0]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(0..=4096), allow_negative_numbers = true)]
    threads: Option<usize>,

    /// Start of all random numbers; the same seed gives the same results to the last bit [default: 1]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(0..=u64::MAX), allow_negative_numbers = true)]
    seed: Option<u64>,

    /// How light between leaves is sampled
    #[arg(long, value_enum, value_name = "HOW", default_value_t = EstimatorFlag::Lines)]
    estimator: EstimatorFlag,

    /// Whether light is followed after it was scattered: all, or none (first order: direct light alone, no exchange is
    /// traced, and the balance states what is scattered) [default: all]
    #[arg(long, value_name = "all|none")]
    scatter: Option<Scatter>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "Results")]
struct ResultFlags {
    /// Folder for the results; created if it does not exist. Files of an earlier result are replaced
    #[arg(long, value_name = "DIR")]
    out: PathBuf,

    /// Form of the result tables: csv or parquet [default: csv]
    #[arg(long, value_name = "FORM")]
    format: Option<TableFormat>,

    /// Write canopy.vtp too: the triangles with their light, for ParaView
    #[arg(long)]
    vtp: bool,

    /// Print errors only: no plan, no progress, no table
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EstimatorFlag {
    /// Parallel lines through the canopy, with more rays where too few lines pass
    Lines,
    /// Rays from every face: slower, and independent of the lines
    Rays,
}

impl From<EstimatorFlag> for Estimator {
    fn from(flag: EstimatorFlag) -> Self {
        match flag {
            EstimatorFlag::Lines => Self::Lines,
            EstimatorFlag::Rays => Self::Rays,
        }
    }
}

impl SolveArgs {
    fn options(&self) -> Options {
        let Self { how, results, .. } = self;
        Options {
            diameter: how.diameter,
            accuracy_percent: how.accuracy,
            memory_GiB: how.memory,
            threads: how.threads,
            seed: how.seed,
            scatter: how.scatter,
            format: results.format,
            vtp: results.vtp.then_some(true),
        }
    }

    pub(crate) fn run(self) -> Result<()> {
        let options = self.options();
        let inputs = self.scene.inputs(options)?;
        let task = Task {
            settings: settings(&inputs.options, self.how.budget, self.how.estimator.into()),
            notes: Notes {
                quiet: self.results.quiet,
            },
            inputs,
            workers: self.workers,
            state: self.state,
            out: self.results.out,
            place: self.place,
        };
        pool(task.inputs.options.threads, task.notes)?.install(|| task.solve())
    }
}

/// All that the user said.
struct Task {
    inputs: Inputs,
    settings: Settings,
    workers: WorkersFlags,
    state: StateFlags,
    out: PathBuf,
    place: MasterFlags,
    notes: Notes,
}

impl Task {
    fn solve(&self) -> Result<()> {
        let mut watch = Stopwatch::start();
        // before the work, not after it
        check_place(&self.out)?;
        let Loaded { scene, inspection } = self.load()?;
        if self
            .inputs
            .bands
            .iter()
            .any(|band| band.photon_umol_J.is_some())
        {
            let line = "photon factors are for `nestrad series` and `nestrad day`: the tables of `solve` are in W only";
            self.notes.say("warning", line);
        }
        watch.lap("input");
        let solved = match &self.place.master {
            None => self.compute(&scene, &mut watch)?,
            Some(url) => {
                let solved = self
                    .place
                    .solve(url, scene.clone(), &self.settings, self.notes)?;
                watch.lap("at the master");
                solved
            }
        };
        self.write(&scene, &inspection, solved, watch)
    }

    /// The same as a master gives back, computed here: what it took is in `watch`.
    fn compute(&self, scene: &Scene, watch: &mut Stopwatch) -> Result<SolvedThere> {
        let progress = Arc::new(Progress::default());
        let bar = Bar::of(&progress, self.notes.quiet);
        let run = Run {
            stop: &Stop::default(),
            progress: &progress,
        };
        let told = |warning: &str| self.notes.say("warning", warning);
        let kept = self.state.open(told)?;
        let crew = self.workers.crew(self.settings.memory_GiB, self.notes)?;
        let workers = crew.as_ref().map(Crew::cluster);
        let begins = |plan: &Plan, before: &[Round]| {
            self.begins(plan, before);
            if let Some(crew) = &crew {
                crew.begin_round(plan);
            }
        };
        let solved = with_rows(workers, kept.as_ref(), |rows| {
            solve_in_rounds(scene, &self.settings, rows, &run, watch, begins)
        });
        let untrusted = workers.map(|workers| workers.status().untrusted);
        let remarks = crew.as_ref().map(|crew| crew.cluster().remarks());
        drop((crew, bar));
        for remark in remarks.iter().flatten() {
            self.notes.say("warning", remark);
        }
        for worker in untrusted.unwrap_or_default() {
            let line = format!("worker {worker} returned wrong rows: they were computed anew");
            self.notes.say("warning", &line);
        }
        if let Some(kept) = kept {
            kept.close();
            if let Some(warning) = kept.warning() {
                self.notes.say("warning", &warning);
            }
        }
        let solved = solved?;
        Ok(SolvedThere {
            plan: serde_json::to_value(solved.plan_record())
                .context("the plan cannot be written down")?,
            solution: solved.solution,
            work: solved.work,
            stages: Vec::new(),
            usage: Usage::default(),
        })
    }

    /// Says what the next round does.
    fn begins(&self, plan: &Plan, before: &[Round]) {
        let reached = before.last().and_then(|round| round.reached_percent);
        if let Some(reached) = reached {
            let round = before.len();
            let line = format!("round {round} reached {reached:.3} %");
            self.notes.say("accuracy", &line);
        }
        for line in &plan.reasons {
            self.notes.say("plan", line);
        }
    }

    fn load(&self) -> Result<Loaded> {
        let loaded = assemble::load(&self.inputs)?;
        for warning in &loaded.inspection.warnings {
            self.notes.say("warning", warning);
        }
        Ok(loaded)
    }

    fn write(
        &self,
        scene: &Scene,
        inspection: &Inspection,
        solved: SolvedThere,
        mut watch: Stopwatch,
    ) -> Result<()> {
        let canopy = &scene.canopy;
        let names = scene.optics.names();
        let solution = &solved.solution;
        let staged = stage(&self.out, canopy, &names, solution, self.formats())?;
        watch.lap("output");
        let here = watch.usage();
        let usage = Usage {
            wall_s: here.wall_s,
            cpu_s: here.cpu_s + solved.usage.cpu_s,
            peak_memory_bytes: here.peak_memory_bytes.max(solved.usage.peak_memory_bytes),
        };
        let master = self.place.master.as_deref();
        let sources = solved.work.sources;
        // the stages of a master come before those of this process
        let elsewhere = solved.stages.into_iter().map(|stage| Stage {
            name: format!("master: {}", stage.name),
            ..stage
        });
        let stages: Vec<Stage> = elsewhere.chain(watch.stages().iter().cloned()).collect();
        staged.commit(&Summary {
            version: env!("CARGO_PKG_VERSION"),
            options: &OptionsRecord::new(
                &self.inputs,
                &scene.light,
                &self.settings,
                sources,
                master,
            ),
            scene: inspection,
            plan: &solved.plan,
            energy_balance: &solution.balance,
            error_estimates: &organ_spread(&canopy.plants(), solution),
            counters: &solved.work,
            stages: &stages,
            resources: usage,
        })?;
        // a master of an earlier version says nothing of it
        let accuracy = Accuracy::deserialize(&solved.plan["accuracy"]).ok();
        if !self.notes.quiet {
            if let Some(accuracy) = &accuracy {
                self.notes.say("accuracy", &accuracy.to_string());
            }
            let mut table = Vec::new();
            terminal::write(&mut table, canopy, solution, usage)?;
            self.notes.show(&table);
            let place = self.out.display();
            self.notes.say("done", &format!("results are in {place}"));
        }
        let missed = accuracy.and_then(|accuracy| self.missed(accuracy));
        missed.map_or(Ok(()), |missed| Err(missed.into()))
    }

    /// The error of a solve whose results are those of an earlier round, for a finer one failed.
    fn missed(&self, accuracy: Accuracy) -> Option<MissedTarget> {
        let is_fault = accuracy.ended == Ended::Failed;
        is_fault.then(|| MissedTarget {
            asked_percent: accuracy.asked_percent,
            reached_percent: accuracy.rounds.last().and_then(|r| r.reached_percent),
            fault: accuracy.failure.unwrap_or_default(),
            place: self.out.display().to_string(),
        })
    }

    fn formats(&self) -> Formats {
        let options = &self.inputs.options;
        Formats {
            table: options.format.unwrap_or_default(),
            vtp: options.vtp.unwrap_or(false),
        }
    }
}
