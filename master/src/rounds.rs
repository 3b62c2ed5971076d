//! Solves in rounds until the error that was asked for is reached.
//!
//! The first round is planned for what was asked, and is the only one where nothing was. Where its own standard errors say that it missed, or where
//! time is short, the next is planned by what the last one measured: its error is taken to fall in proportion
//! to the accuracy that is planned for, and its cost to rise with the square.

use std::fmt;
use std::time::Instant;

use nestrad_common::problem::Problem;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::output::errors::ErrorParts;
use crate::output::progress::Progress;
use crate::output::resources::Stopwatch;
use crate::plan::{Plan, PlanError, Settings};
use crate::run::{Finished, Means, RunError, solve_with};

/// The last round, and how it came to it.
#[derive(Clone, Debug)]
pub struct Reached {
    /// Its plan.
    pub plan: Plan,
    /// Its results.
    pub finished: Finished,
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
    /// Accuracy that it was planned for.
    pub planned_percent: f64,
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

/// Never more rounds than this.
const MOST_ROUNDS: usize = 5;

/// Solves until the accuracy of the settings is reached, or their time is up. `begins` is told of every plan
/// before it is carried out, and of the rounds before it.
pub fn solve_in_rounds(
    problem: &Problem,
    settings: &Settings,
    means: Means,
    progress: &Progress,
    watch: &mut Stopwatch,
    mut begins: impl FnMut(&Plan, &[Round]),
) -> Result<Reached, RoundsError> {
    let begun = Instant::now();
    let asked = settings.accuracy_percent;
    let mut planned = settings.budget_s.map_or(asked, |_| pilot(asked));
    let mut plan = Plan::new(problem, &at(settings, planned))?;
    let mut rounds = Vec::new();
    loop {
        begins(&plan, &rounds);
        watch.lap("plan");
        progress.check().map_err(RunError::from)?;
        let round_begun = Instant::now();
        let finished = solve_with(problem, &plan, means, progress, watch)?;
        let worst = worst(&finished.errors);
        let reached_percent = worst.map(|parts| parts.total_percent());
        rounds.push(Round {
            planned_percent: planned,
            reached_percent,
        });
        let next = match worst.filter(|parts| parts.total_percent() > asked) {
            None => Err(Ended::Reached),
            Some(_) if !settings.in_rounds => Err(Ended::NotAsked),
            Some(_) if rounds.len() >= MOST_ROUNDS => Err(Ended::OutOfRounds),
            Some(parts) => {
                let finer = finer(planned, asked, parts);
                let left_s = settings.budget_s.map(|s| s - begun.elapsed().as_secs_f64());
                let took_s = round_begun.elapsed().as_secs_f64();
                match left_s {
                    Some(left_s) => within(planned, finer, took_s, left_s),
                    None => Some(finer),
                }
                .ok_or(Ended::OutOfTime)
            }
        };
        let next = next.and_then(|finer| {
            let plan = Plan::new(problem, &at(settings, finer));
            plan.map(|plan| (finer, plan))
                .map_err(|_| Ended::BeyondLimits)
        });
        match next {
            Ok(next) => (planned, plan) = next,
            Err(ended) => {
                let accuracy = Accuracy {
                    asked_percent: asked,
                    ended,
                    rounds,
                    errors: finished.errors.clone(),
                };
                return Ok(Reached {
                    plan,
                    finished,
                    accuracy,
                });
            }
        }
    }
}

fn at(settings: &Settings, accuracy_percent: f64) -> Settings {
    Settings {
        accuracy_percent,
        ..*settings
    }
}

/// The band with the largest error.
fn worst(errors: &[ErrorParts]) -> Option<&ErrorParts> {
    let by_total =
        |a: &&ErrorParts, b: &&ErrorParts| a.total_percent().total_cmp(&b.total_percent());
    errors.iter().max_by(by_total)
}

/// Planning for less than this makes the exchange no coarser (see `plan`: a batch has a set of axes at least).
const COARSEST_EXCHANGE_PERCENT: f64 = 0.7;

/// The next round aims a bit lower than it must: errors of errors.
const AIM: f64 = 0.9;

/// A round is not planned for an accuracy finer than the last one's by more than this: the cost grows with
/// its square.
const MOST_FINER: f64 = 6.0;

/// What a first round is planned for that is to tell how long things take.
fn pilot(asked: f64) -> f64 {
    asked.max((4.0 * asked).min(2.0))
}

/// What to plan the next round for.
fn finer(planned: f64, asked: f64, parts: &ErrorParts) -> f64 {
    let start = if parts.exchange_percent > parts.direct_percent {
        planned.min(COARSEST_EXCHANGE_PERCENT)
    } else {
        planned
    };
    (AIM * start * asked / parts.total_percent()).max(planned / MOST_FINER)
}

/// What to plan the next round for where only so much time is left; none where that would hardly help.
fn within(planned: f64, finer: f64, took_s: f64, left_s: f64) -> Option<f64> {
    // what takes no less time when it is coarser
    let start = planned.min(COARSEST_EXCHANGE_PERCENT);
    let finest = start * (took_s.max(f64::MIN_POSITIVE) / left_s.max(0.0)).sqrt();
    let next = finer.max(finest);
    (next < HARDLY * start).then_some(next)
}

/// A round that is planned for more than this part of the last one's accuracy hardly helps.
const HARDLY: f64 = 0.9;

#[cfg(test)]
mod tests {
    use super::*;

    fn parts(exchange_percent: f64, direct_percent: f64) -> ErrorParts {
        ErrorParts {
            band: "PAR".to_owned(),
            exchange_percent,
            direct_percent,
            ..ErrorParts::default()
        }
    }

    #[test]
    fn the_next_round_is_finer_by_as_much_as_the_last_one_missed() {
        let next = finer(0.5, 0.5, &parts(0.6, 0.8));
        assert!((next - 0.45 * 0.5).abs() < 1e-12, "{next}");
        // where lines are too few, planning for 1 % instead of 2 % would change nothing
        let next = finer(2.0, 1.0, &parts(1.4, 0.0));
        assert!((next - 0.9 * 0.7 / 1.4).abs() < 1e-12, "{next}");
        assert_eq!(finer(0.6, 0.5, &parts(500.0, 0.0)), 0.6 / MOST_FINER);
    }

    #[test]
    fn a_pilot_is_coarser_than_what_is_asked_for_or_as_coarse() {
        assert_eq!([0.1, 0.5, 1.0, 5.0].map(pilot), [0.4, 2.0, 2.0, 5.0]);
    }

    #[test]
    fn a_round_that_fits_no_more_is_made_coarser_or_left_out() {
        assert_eq!(within(0.4, 0.1, 1.0, 100.0), Some(0.1));
        assert_eq!(within(0.4, 0.1, 1.0, 4.0), Some(0.2));
        assert_eq!(within(0.4, 0.1, 1.0, 1.1), None);
        assert_eq!(within(0.4, 0.1, 1.0, -1.0), None);
    }

    #[test]
    fn the_band_with_the_largest_error_counts() {
        let (a, b) = (parts(0.1, 0.1), parts(0.3, 0.0));
        assert_eq!(worst(&[a, b.clone()]), Some(&b));
        assert_eq!(worst(&[]), None);
    }
}
