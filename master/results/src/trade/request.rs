//! What is to be studied, and how a run of it is solved.

use std::path::Path;

use nestrad_common::scene::Scene;
use nestrad_engine::exchange::ThisProcess;
use nestrad_engine::heap::Freed;
use nestrad_engine::lit_canopy::LitCanopy;
use nestrad_engine::plan::Aims;
use nestrad_engine::rounds::{RoundsError, solve_in_rounds};
use nestrad_engine::run::Run;
use nestrad_engine::solution::Solution;
use nestrad_engine::stopwatch::{Stage, Stopwatch, forget_peak_memory};
use nestrad_engine::traced::{self, WorkDone};

use super::error::TradeError;
use super::setting::Setting;

/// What to study.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The canopy under its light. Where there is a sky, every run has its own directions of it, as many as its
    /// accuracy asks for, so that their error is in its own.
    pub scene: &'a Scene,
    /// Folder of the ledger.
    pub out: &'a Path,
    /// Settings to try.
    pub settings: &'a [Setting],
    /// Finest error that a setting is wanted for, percent; the reference is about half of it.
    pub finest_percent: f64,
    /// Memory that a solve may take, GiB.
    pub memory_GiB: f64,
    /// Runs of each setting, at least two: their scatter is in the error bars.
    pub runs: u32,
    /// Seed of the first run; the others follow it.
    pub seed: u64,
}

/// How a run is solved, and with which seed.
pub(super) enum How {
    /// In rounds, as a user asks for it.
    Asked(Setting, u64),
    /// In one, by a plan for these aims whose knobs are turned.
    Turned(Setting, u64, Aims),
}

impl Request<'_> {
    /// What a run depends on, besides the scene and the threads.
    pub(super) fn name(&self, how: &How) -> Result<String, TradeError> {
        let (setting, seed, aims) = match how {
            How::Asked(setting, seed) => (setting, seed, None),
            How::Turned(setting, seed, aims) => (setting, seed, Some(aims)),
        };
        let what = (setting, seed, aims, self.memory_GiB);
        serde_json::to_string(&what).map_err(TradeError::Name)
    }

    /// A solve, with its own peak of memory.
    pub(super) fn solved(&self, how: &How, run: &Run) -> Result<(RunResult, Cost), RoundsError> {
        // what earlier runs have let go of is not to be part of this one's peak
        Freed::default().give_back();
        let anew = forget_peak_memory();
        let mut watch = Stopwatch::start();
        let solved = match how {
            How::Asked(setting, seed) => self.in_rounds(setting, *seed, run, &mut watch),
            How::Turned(setting, seed, aims) => self.in_one(setting, *seed, aims, run, &mut watch),
        }?;
        let usage = watch.usage();
        let cost = Cost {
            wall_s: usage.wall_s,
            cpu_s: usage.cpu_s,
            peak_memory_bytes: usage.peak_memory_bytes.filter(|_| anew),
            stages: watch.stages().to_vec(),
        };
        Ok((solved, cost))
    }

    fn in_rounds(
        &self,
        setting: &Setting,
        seed: u64,
        run: &Run,
        watch: &mut Stopwatch,
    ) -> Result<RunResult, RoundsError> {
        let (settings, rows) = (
            setting.settings(self.memory_GiB, seed),
            ThisProcess::default(),
        );
        let solved = solve_in_rounds(self.scene, &settings, &rows, run, watch, |_, _| ())?;
        Ok(RunResult {
            aims: solved.plan.aims,
            solution: solved.solution,
            work: solved.work,
        })
    }

    fn in_one(
        &self,
        setting: &Setting,
        seed: u64,
        aims: &Aims,
        run: &Run,
        watch: &mut Stopwatch,
    ) -> Result<RunResult, RoundsError> {
        let scene = self.scene;
        let lit = LitCanopy {
            canopy: &scene.canopy,
            optics: &scene.optics,
            sources: &scene.light.sources(aims.sky_directions(), seed),
            sensors: &[],
        };
        let plan = setting.turned(&lit, aims, self.memory_GiB, seed)?;
        let (solution, work) = traced::solve(&lit, &plan, &ThisProcess::default(), run, watch)?;
        Ok(RunResult {
            aims: *aims,
            solution,
            work,
        })
    }
}

/// What a run came to, and what its last round was planned for.
pub(super) struct RunResult {
    pub(super) aims: Aims,
    pub(super) solution: Solution,
    pub(super) work: WorkDone,
}

/// What a run took.
pub(super) struct Cost {
    pub(super) wall_s: f64,
    pub(super) cpu_s: f64,
    pub(super) peak_memory_bytes: Option<u64>,
    pub(super) stages: Vec<Stage>,
}
