//! What is to be studied, and how a run of it is solved.

use std::borrow::Cow;
use std::path::Path;

use nestrad_common::light::SkyLight;
use nestrad_common::light::sky::SkyError;
use nestrad_common::problem::Problem;

use super::error::TradeError;
use super::setting::Setting;
use crate::heap::Freed;
use crate::output::progress::Progress;
use crate::output::resources::{Stage, Stopwatch, forget_peak_memory};
use crate::plan::Aims;
use crate::rounds::{RoundsError, solve_in_rounds};
use crate::run::{Finished, Means, solve};

/// What to study.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The scene under its light.
    pub problem: &'a Problem,
    /// The sky that it is lit by, if it is: every run has its own directions of it, as many as its accuracy asks
    /// for, so that their error is in its own.
    pub sky: Option<&'a SkyLight>,
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

impl<'a> Request<'a> {
    /// The scene as a solve for these aims would light it.
    fn lit(&self, aims: &Aims, seed: u64) -> Result<Cow<'a, Problem>, SkyError> {
        let mut problem = Cow::Borrowed(self.problem);
        if let Some(sky) = self.sky {
            problem
                .to_mut()
                .light_by(sky, aims.sky_directions(), seed)?;
        }
        Ok(problem)
    }

    /// What a run depends on, besides the scene and the threads.
    pub(super) fn name(&self, how: &How) -> Result<String, TradeError> {
        let (setting, seed, aims) = match how {
            How::Asked(setting, seed) => (setting, seed, None),
            How::Turned(setting, seed, aims) => (setting, seed, Some(aims)),
        };
        let sky = self.sky.map(|sky| format!("{sky:?}"));
        let what = (setting, seed, aims, self.memory_GiB, sky);
        serde_json::to_string(&what).map_err(TradeError::Name)
    }

    /// A solve, with its own peak of memory.
    pub(super) fn solved(
        &self,
        how: &How,
        progress: &Progress,
    ) -> Result<Result<(Own, Cost), RoundsError>, SkyError> {
        let (setting, seed, aims) = match how {
            How::Asked(setting, seed) => (setting, *seed, Aims::of(setting.accuracy_percent)),
            How::Turned(setting, seed, aims) => (setting, *seed, *aims),
        };
        let problem = self.lit(&aims, seed)?;
        Freed::default().give_back();
        let anew = forget_peak_memory();
        let mut watch = Stopwatch::start();
        let own = match how {
            How::Asked(..) => self.in_rounds(&problem, setting, seed, progress, &mut watch),
            How::Turned(..) => setting
                .turned(&problem, &aims, self.memory_GiB, seed)
                .map_err(RoundsError::from)
                .and_then(|plan| Ok(solve(&problem, &plan, progress, &mut watch)?))
                .map(|finished| Own { aims, finished }),
        };
        let usage = watch.usage();
        let cost = Cost {
            wall_s: usage.wall_s,
            cpu_s: usage.cpu_s,
            peak_memory_bytes: usage.peak_memory_bytes.filter(|_| anew),
            stages: watch.stages().to_vec(),
        };
        Ok(own.map(|own| (own, cost)))
    }

    fn in_rounds(
        &self,
        problem: &Problem,
        setting: &Setting,
        seed: u64,
        progress: &Progress,
        watch: &mut Stopwatch,
    ) -> Result<Own, RoundsError> {
        let (settings, means) = (setting.settings(self.memory_GiB, seed), Means::default());
        let reached = solve_in_rounds(
            problem,
            self.sky,
            &settings,
            means,
            progress,
            watch,
            |_, _| (),
        )?;
        Ok(Own {
            aims: reached.plan.aims,
            finished: reached.finished,
        })
    }
}

/// What a run came to, and what its last round was planned for.
pub(super) struct Own {
    pub(super) aims: Aims,
    pub(super) finished: Finished,
}

/// What a run took.
pub(super) struct Cost {
    pub(super) wall_s: f64,
    pub(super) cpu_s: f64,
    pub(super) peak_memory_bytes: Option<u64>,
    pub(super) stages: Vec<Stage>,
}
