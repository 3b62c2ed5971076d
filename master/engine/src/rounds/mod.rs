//! Solves in rounds until the error that was asked for is reached.
//!
//! The first round is planned for what was asked, and is the only one where nothing was; or it is a coarse look,
//! where that costs little beside it or where time is short. Where its own errors say that it missed, the next is
//! planned by what the last one measured (`next.rs`).

mod accuracy;
mod next;
mod work;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Instant;

use nestrad_common::light::Sources;
use nestrad_common::scene::Scene;
use serde::Serialize;
use thiserror::Error;

use crate::causes::causes;
use crate::exchange::RowSource;
use crate::lit_canopy::LitCanopy;
use crate::plan::{Aims, AtFinest, Plan, PlanError, Settings, TracePlan, WorkCounts};
use crate::resident::Resident;
use crate::run::Run;
use crate::solution::{BandAccount, Solution};
use crate::solve_error::FailureKind;
use crate::stopwatch::Stopwatch;
use crate::traced::{SolveError, WorkDone};
use accuracy::worst;
pub use accuracy::{Accuracy, Ended, Round};
use next::Measured;
use work::work_s;

/// The last round, and how it came to it.
#[derive(Clone, Debug)]
pub struct Solved {
    /// Its plan.
    pub plan: Plan,
    /// Its results.
    pub solution: Solution,
    /// How much it computed.
    pub work: WorkDone,
    /// What was asked for, and what came of it.
    pub accuracy: Accuracy,
}

/// A plan as it is kept with the results.
#[derive(Debug, Serialize)]
pub struct PlanRecord<'a> {
    #[serde(flatten)]
    plan: &'a Plan,
    accuracy: &'a Accuracy,
}

impl Solved {
    /// What is kept of the plan.
    pub fn plan_record(&self) -> PlanRecord<'_> {
        PlanRecord {
            plan: &self.plan,
            accuracy: &self.accuracy,
        }
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
    Solve(#[from] SolveError),
}

impl RoundsError {
    /// Its kind.
    pub fn kind(&self) -> FailureKind {
        match self {
            Self::Plan(error) => error.kind(),
            Self::Solve(error) => error.kind(),
        }
    }
}

/// A coarse look comes first where it takes less than this part of what is planned without one.
const WORTH_A_LOOK: f64 = 0.2;

/// Never more rounds than this.
const MOST_ROUNDS: usize = 5;

/// Solves until the accuracy of the settings is reached, or their time is up. This is where a sky becomes
/// directions: as many as a round aims for. `begins` is told of every plan before it is carried out, and of the
/// rounds before it.
pub fn solve_in_rounds(
    scene: &Scene,
    settings: &Settings,
    rows: &dyn RowSource,
    run: &Run,
    watch: &mut Stopwatch,
    begins: impl FnMut(&Plan, &[Round]),
) -> Result<Solved, RoundsError> {
    let resident = &mut Resident::between_rounds();
    light_in_rounds((scene, resident), settings, rows, run, watch, begins)
}

/// The same with a canopy that may be resident, and is so afterwards if there is room. It begins as finely as it was
/// traced: another light traces nothing unless it needs more.
pub fn light_in_rounds(
    (scene, resident): (&Scene, &mut Resident),
    settings: &Settings,
    rows: &dyn RowSource,
    run: &Run,
    watch: &mut Stopwatch,
    mut begins: impl FnMut(&Plan, &[Round]),
) -> Result<Solved, RoundsError> {
    let begun = Instant::now();
    let asked = settings.accuracy_percent;
    let (mut sources, mut plan) = match resident.traced_for(&scene.canopy, settings) {
        Some(traced) => again(scene, settings, traced)?,
        None => first(scene, settings)?,
    };
    let mut rounds = Vec::new();
    let mut last: Option<Solved> = None;
    loop {
        begins(&plan, &rounds);
        watch.lap("plan");
        run.stop.check().map_err(SolveError::from)?;
        let round_begun = Instant::now();
        let lit = lit_canopy(scene, &sources);
        let canopy = (&scene.canopy, settings);
        // a panic must not take the results of the round before with it
        let round = catch_unwind(AssertUnwindSafe(|| {
            resident.solve(canopy, (&lit, &plan), rows, run, watch)
        }));
        let round = round.unwrap_or_else(|panic| Err(SolveError::of_panic(&*panic)));
        let (solution, work) = match (round, last) {
            (Ok(done), _) => done,
            // whoever wants no more does not want the round before either
            (Err(error @ SolveError::Stopped(_)), _) | (Err(error), None) => {
                return Err(error.into());
            }
            (Err(error), Some(mut before)) => {
                before.accuracy.failure = Some(causes(&error));
                return Ok(before);
            }
        };
        let took_s = round_begun.elapsed().as_secs_f64();
        let reached_percent = worst(&solution.account).map(BandAccount::total_percent);
        rounds.push(Round {
            planned: plan.aims,
            reached_percent,
        });
        let measured = Measured {
            aims: plan.aims,
            coarsest_exchange_percent: plan.coarsest_exchange_percent(&scene.canopy),
            errors: &solution.account,
            fixed: {
                let finest = plan.at_finest();
                let sky = scene.light.sky.is_none() || finest.sky;
                let AtFinest {
                    exchange,
                    direct,
                    elements,
                    soil,
                    ..
                } = finest;
                [exchange, direct, sky, elements, soil]
            },
            cost_s: work_s(&WorkCounts::of(&lit, &plan)),
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
        let next = next.and_then(|aims| within_limits(scene, settings, (&sources, &plan), &aims));
        let solved = Solved {
            accuracy: Accuracy {
                asked_percent: asked,
                ended: next.as_ref().err().copied().unwrap_or(Ended::Failed),
                rounds: rounds.clone(),
                errors: solution.account.clone(),
                failure: None,
            },
            plan,
            solution,
            work,
        };
        match next {
            Ok(next) => {
                (sources, plan) = next;
                last = Some(solved);
            }
            Err(_) => return Ok(solved),
        }
    }
}

/// The plan that a solve begins with: whatever refuses a solve before anything is computed refuses this.
pub fn first_plan(scene: &Scene, settings: &Settings) -> Result<Plan, RoundsError> {
    Ok(first(scene, settings)?.1)
}

/// The first round: what is asked for, or a coarse look where that saves.
fn first(scene: &Scene, settings: &Settings) -> Result<(Sources, Plan), PlanError> {
    let aims = Aims::of(settings.accuracy_percent);
    let sources = sources_for(scene, &aims, settings);
    let plan = Plan::new(&lit_canopy(scene, &sources), settings);
    if !settings.in_rounds {
        return Ok((sources, plan?));
    }
    let aims = Aims::pilot(settings.accuracy_percent);
    let coarse = sources_for(scene, &aims, settings);
    let look = Plan::aimed(&lit_canopy(scene, &coarse), settings, &aims);
    let all_s = |sources, plan| {
        let counts = WorkCounts::of(&lit_canopy(scene, sources), plan);
        work_s(&counts).iter().sum::<f64>()
    };
    match (plan, look) {
        (Ok(plan), Ok(look))
            if settings.budget_s.is_some()
                || all_s(&coarse, &look) < WORTH_A_LOOK * all_s(&sources, &plan) =>
        {
            Ok((coarse, look))
        }
        // it may not need as much as it was planned with
        (Err(PlanError::Memory { .. } | PlanError::Elements { .. }), Ok(look)) => {
            Ok((coarse, look))
        }
        (plan, _) => Ok((sources, plan?)),
    }
}

/// The first round of a canopy that was traced by such a plan, for such aims.
fn again(
    scene: &Scene,
    settings: &Settings,
    (trace, aims): (&TracePlan, &Aims),
) -> Result<(Sources, Plan), PlanError> {
    let sources = sources_for(scene, aims, settings);
    let plan = Plan::of_traced(&lit_canopy(scene, &sources), settings, (trace, aims))?;
    Ok((sources, plan))
}

/// The sources of a scene, with as many directions of its sky as the aims ask for.
fn sources_for(scene: &Scene, aims: &Aims, settings: &Settings) -> Sources {
    scene.light.sources(aims.sky_directions(), settings.seed)
}

fn lit_canopy<'a>(scene: &'a Scene, sources: &'a Sources) -> LitCanopy<'a> {
    LitCanopy {
        canopy: &scene.canopy,
        optics: &scene.optics,
        sources,
    }
}

/// The next round, as finely as the limits allow: what memory stands against must not keep it from helping the rest.
fn within_limits(
    scene: &Scene,
    settings: &Settings,
    (sources, last): (&Sources, &Plan),
    finer: &Aims,
) -> Result<(Sources, Plan), Ended> {
    for part in OF_THE_WAY {
        let aims = last.aims.towards(finer, part);
        if part < 1.0 && !is_worth_a_round(&last.aims, &aims) {
            break;
        }
        let sources = if aims.sky_percent < last.aims.sky_percent {
            sources_for(scene, &aims, settings)
        } else {
            sources.clone()
        };
        let lit = lit_canopy(scene, &sources);
        let plan = if aims.trace_as(&last.aims) {
            Plan::of_traced(&lit, settings, (&last.trace, &aims))
        } else {
            Plan::aimed(&lit, settings, &aims)
        };
        match plan {
            Ok(plan) => return Ok((sources, plan)),
            Err(PlanError::Memory { .. } | PlanError::Elements { .. }) => {}
            Err(_) => break,
        }
    }
    Err(Ended::BeyondLimits)
}

/// Parts of the way to finer aims that are tried, of what takes memory.
const OF_THE_WAY: [f64; 5] = [1.0, 0.9, 0.75, 0.5, 0.0];

/// Whether any part of what is left of a plan would be finer by enough to be worth a round.
fn is_worth_a_round(last: &Aims, next: &Aims) -> bool {
    const ENOUGH: f64 = 0.9;
    let parts = |aims: &Aims| {
        [
            aims.exchange_percent,
            aims.direct_percent,
            aims.sky_percent,
            aims.elements_percent,
            aims.soil_percent,
        ]
    };
    let pairs = parts(next).into_iter().zip(parts(last));
    pairs.into_iter().any(|(next, last)| next < ENOUGH * last)
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
