//! Solves in rounds until the error that was asked for is reached.
//!
//! The first round is planned for what was asked, and is the only one where nothing was; or it is a coarse look,
//! where that costs little beside it or where time is short. Where its own errors say that it missed, the next is
//! planned by what the last one measured (`next.rs`).

mod next;
mod work;

use std::borrow::Cow;
use std::fmt;
use std::time::Instant;

use nestrad_common::light::SkyLight;
use nestrad_common::problem::Problem;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::errors::ErrorParts;
use crate::output::progress::Progress;
use crate::output::resources::Stopwatch;
use crate::plan::{Aims, Counts, Plan, PlanError, Settings};
use crate::run::{Finished, Means, RunError, solve_with};
use next::Measured;
use work::work_s;

/// The last round, and how it came to it.
#[derive(Clone, Debug)]
pub struct Reached {
    /// Its plan.
    pub plan: Plan,
    /// Its results.
    pub finished: Finished,
    /// Sources that it was lit by.
    pub sources: usize,
    /// What was asked for, and what came of it.
    pub accuracy: Accuracy,
}

/// A plan as it is kept with the results.
#[derive(Debug, Serialize)]
pub struct Record<'a> {
    #[serde(flatten)]
    plan: &'a Plan,
    accuracy: &'a Accuracy,
}

impl Reached {
    /// What is kept of the plan.
    pub fn record(&self) -> Record<'_> {
        Record {
            plan: &self.plan,
            accuracy: &self.accuracy,
        }
    }
}

/// What was asked for, and what came of it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Accuracy {
    /// Error that was asked for: of the worst band, rms over organs, percent of the mean.
    pub asked_percent: f64,
    /// Why there was no further round.
    pub ended: Ended,
    /// All rounds.
    pub rounds: Vec<Round>,
    /// What the error of the last one comes from, by band.
    pub errors: Vec<ErrorParts>,
}

/// A round.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Round {
    /// What its parts were planned for.
    pub planned: Aims,
    /// Error of its worst band, by its own account; none where nothing is absorbed.
    pub reached_percent: Option<f64>,
}

/// Why there was no further round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// The error is what was asked for, or less.
    Reached,
    /// A finer one would have taken longer than allowed.
    OutOfTime,
    /// A finer one would have taken more memory, or more lines, than there may be.
    BeyondLimits,
    /// There have been enough.
    OutOfRounds,
    /// What is left cannot be planned for: the mean field beyond the sphere, or the directions of a sky that were
    /// given.
    NoFiner,
    /// A finer one failed.
    Failed,
    /// No accuracy was asked for: what the default comes to has to do.
    NotAsked,
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(parts) = worst(&self.errors) else {
            return f.write_str("nothing is absorbed, so there is no error");
        };
        let why = match self.ended {
            Ended::Reached => "",
            Ended::OutOfTime => ", because the time allowed is up",
            Ended::BeyondLimits => ", because finer plans are beyond the limits",
            Ended::OutOfRounds => ", however fine it was planned",
            Ended::NoFiner => ", because no finer plan would help",
            Ended::Failed => ", because a finer round failed",
            Ended::NotAsked => ", which is no more than the default: --accuracy sees to it",
        };
        write!(
            f,
            "{:.2} % reached in {}, aimed at {} %{why}; from",
            parts.total_percent(),
            parts.band,
            self.asked_percent,
        )?;
        let (mut comma, largest) = ("", parts.largest());
        for (percent, name) in parts.named().into_iter().filter(|part| part.0 > 0.0) {
            let most = if name == largest {
                " (the largest)"
            } else {
                ""
            };
            write!(f, "{comma} {name} {percent:.2}{most}")?;
            comma = ",";
        }
        f.write_str(" %")
    }
}

/// Why there is no result.
#[derive(Debug, Error)]
pub enum RoundsError {
    /// No plan can be made.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A solve failed.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// A coarse look comes first where it takes less than this part of what is planned without one.
const WORTH_A_LOOK: f64 = 0.2;

/// Never more rounds than this.
const MOST_ROUNDS: usize = 5;

/// Solves until the accuracy of the settings is reached, or their time is up. A scene that is lit by a built-in
/// `sky` gets more directions of it where they are too few; `problem` has the first of them. `begins` is told of
/// every plan before it is carried out, and of the rounds before it.
pub fn solve_in_rounds(
    problem: &Problem,
    sky: Option<&SkyLight>,
    settings: &Settings,
    means: Means,
    progress: &Progress,
    watch: &mut Stopwatch,
    mut begins: impl FnMut(&Plan, &[Round]),
) -> Result<Reached, RoundsError> {
    let begun = Instant::now();
    let asked = settings.accuracy_percent;
    let (mut problem, mut plan) = first(problem, sky, settings)?;
    let mut rounds = Vec::new();
    let mut last: Option<Reached> = None;
    loop {
        begins(&plan, &rounds);
        watch.lap("plan");
        progress.check().map_err(RunError::from)?;
        let round_begun = Instant::now();
        let finished = match (solve_with(&problem, &plan, means, progress, watch), last) {
            (Ok(finished), _) => finished,
            (Err(error), None) => return Err(error.into()),
            (Err(_), Some(mut before)) => {
                // whoever wants no more does not want the round before either
                progress.check().map_err(RunError::from)?;
                before.accuracy.ended = Ended::Failed;
                return Ok(before);
            }
        };
        let took_s = round_begun.elapsed().as_secs_f64();
        let reached_percent = worst(&finished.errors).map(ErrorParts::total_percent);
        rounds.push(Round {
            planned: plan.aims,
            reached_percent,
        });
        let measured = Measured {
            aims: plan.aims,
            coarsest_exchange_percent: plan.coarsest_exchange_percent(&problem),
            errors: &finished.errors,
            sky_is_fixed: sky.is_none() || plan.aims.has_most_sky_directions(),
            cost_s: work_s(&Counts::of(&problem, &plan)),
        };
        let left_s = settings.budget_s.map(|s| s - begun.elapsed().as_secs_f64());
        let next = if reached_percent.is_none_or(|reached| reached <= asked) {
            Err(Ended::Reached)
        } else if !settings.in_rounds {
            Err(Ended::NotAsked)
        } else if rounds.len() >= MOST_ROUNDS {
            Err(Ended::OutOfRounds)
        } else {
            following(&measured, asked, left_s.map(|left_s| (took_s, left_s)))
        };
        let next = next.and_then(|aims| {
            let problem = if aims.sky_percent < plan.aims.sky_percent {
                lit(&problem, sky, &aims, settings.seed).ok_or(Ended::NoFiner)?
            } else {
                problem.clone()
            };
            let plan = Plan::aimed(&problem, settings, &aims);
            plan.map(|plan| (problem, plan))
                .map_err(|_| Ended::BeyondLimits)
        });
        let reached = Reached {
            accuracy: Accuracy {
                asked_percent: asked,
                ended: next.as_ref().err().copied().unwrap_or(Ended::Failed),
                rounds: rounds.clone(),
                errors: finished.errors.clone(),
            },
            sources: problem.sources.len(),
            plan,
            finished,
        };
        match next {
            Ok(next) => {
                (problem, plan) = next;
                last = Some(reached);
            }
            Err(_) => return Ok(reached),
        }
    }
}

/// The first round: what is asked for, or a coarse look where that saves.
fn first<'a>(
    problem: &'a Problem,
    sky: Option<&SkyLight>,
    settings: &Settings,
) -> Result<(Cow<'a, Problem>, Plan), PlanError> {
    let problem = Cow::Borrowed(problem);
    let plan = Plan::new(&problem, settings);
    if !settings.in_rounds {
        return Ok((problem, plan?));
    }
    let aims = Aims::pilot(settings.accuracy_percent);
    let look = lit(&problem, sky, &aims, settings.seed).and_then(|problem| {
        let plan = Plan::aimed(&problem, settings, &aims).ok()?;
        Some((problem, plan))
    });
    let all_s = |problem, plan| work_s(&Counts::of(problem, plan)).iter().sum::<f64>();
    match (plan, look) {
        (Ok(plan), Some((coarse, look)))
            if settings.budget_s.is_some()
                || all_s(&coarse, &look) < WORTH_A_LOOK * all_s(&problem, &plan) =>
        {
            Ok((coarse, look))
        }
        // it may not need as much as it was planned with
        (Err(PlanError::Memory { .. } | PlanError::Elements { .. }), Some(look)) => Ok(look),
        (plan, _) => Ok((problem, plan?)),
    }
}

/// The problem with as many directions of its sky as the aims ask for; as it is where it has none.
fn lit<'a>(
    problem: &Cow<'a, Problem>,
    sky: Option<&SkyLight>,
    aims: &Aims,
    seed: u64,
) -> Option<Cow<'a, Problem>> {
    let mut problem = problem.clone();
    if let Some(sky) = sky {
        // the same sky, as it was checked before
        let directions = aims.sky_directions();
        problem.to_mut().light_by(sky, directions, seed).ok()?;
    }
    Some(problem)
}

/// What to plan the next round for; where time is limited, with what the last one took and what is left.
fn following(
    measured: &Measured,
    asked: f64,
    took_and_left_s: Option<(f64, f64)>,
) -> Result<Aims, Ended> {
    let finer = measured.finer(asked).ok_or(Ended::NoFiner)?;
    let finer = match took_and_left_s {
        Some((took_s, left_s)) => measured
            .within(finer, took_s, left_s)
            .ok_or(Ended::OutOfTime)?,
        None => finer,
    };
    Ok(measured.aims(&finer))
}

/// The band with the largest error.
fn worst(errors: &[ErrorParts]) -> Option<&ErrorParts> {
    let by_total =
        |a: &&ErrorParts, b: &&ErrorParts| a.total_percent().total_cmp(&b.total_percent());
    errors.iter().max_by(by_total)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_band_with_the_largest_error_counts() {
        let of = |exchange_percent| ErrorParts {
            exchange_percent,
            ..ErrorParts::default()
        };
        assert_eq!(worst(&[of(0.1), of(0.3)]), Some(&of(0.3)));
        assert_eq!(worst(&[]), None);
    }
}
