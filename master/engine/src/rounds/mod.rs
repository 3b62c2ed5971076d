//! Solves in rounds until the error that was asked for is reached.
//!
//! The first round is planned for what was asked, and is the only one where nothing was; or it is a coarse look,
//! where that costs little beside it or where time is short. Where its own errors say that it missed, the next is
//! planned by what the last one measured (`next.rs`).

mod accuracy;
mod allot;
mod clock;
mod first;
mod limits;
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
use clock::{Clock, Until};
use first::{first, in_place_of};
use limits::Choice;
use next::Measured;
use work::{PARTS, Takes, work_s};

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

/// Never more rounds than this.
const MOST_ROUNDS: usize = 5;

/// Solves until the accuracy of the settings is reached, or their time is up. This is where a sky becomes
/// directions: as many as a round aims for. `begins` is told of every plan before it is carried out, and of the
/// rounds before it.
///
/// Where rows turn out to be those of a worker that is not to be trusted, the rounds before may have been, too: all are
/// done anew, without it.
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

/// The same with a canopy that may be resident, and is so afterwards if there is room: another light traces nothing.
/// See [`Resident::going_on`] for rounds.
pub fn light_in_rounds(
    (scene, resident): (&Scene, &mut Resident),
    settings: &Settings,
    rows: &dyn RowSource,
    run: &Run,
    watch: &mut Stopwatch,
    mut begins: impl FnMut(&Plan, &[Round]),
) -> Result<Solved, RoundsError> {
    let mut clock = settings.budget_s.map(Clock::start);
    loop {
        let means = (rows, run, &mut *watch);
        let solved = rounds(
            (scene, &mut *resident),
            settings,
            means,
            &mut clock,
            &mut begins,
        );
        match solved {
            // what was traced so far may be wrong
            Err(RoundsError::Solve(error)) if error.is_distrust() => resident.forget(),
            ended => return ended,
        }
    }
}

/// The rounds, where every worker can be trusted.
fn rounds(
    (scene, resident): (&Scene, &mut Resident),
    settings: &Settings,
    (rows, run, watch): (&dyn RowSource, &Run, &mut Stopwatch),
    clock: &mut Option<Clock>,
    begins: &mut impl FnMut(&Plan, &[Round]),
) -> Result<Solved, RoundsError> {
    let asked = settings.accuracy_percent;
    let (mut sources, mut plan) = match resident.goes_on_with(&scene.canopy, settings) {
        Some(traced) => again(scene, settings, traced)?,
        None => first(scene, settings, clock.as_ref())?,
    };
    let mut instead = match clock {
        Some(_) => in_place_of((&sources, &plan), scene, settings),
        None => None,
    };
    let mut rounds = Vec::new();
    let mut best: Option<Solved> = None;
    loop {
        begins(&plan, &rounds);
        watch.lap("plan");
        run.stop.check().map_err(SolveError::from)?;
        let (round_begun, stages_before) = (Instant::now(), watch.stages().len());
        let lit = lit_canopy(scene, &sources);
        let canopy = (&scene.canopy, settings);
        let in_time = run.stop.part();
        let until = match (&best, &instead) {
            (Some(_), _) => Until::End,
            (None, Some((sources, plan))) => Until::GivesWay {
                to: Takes::of(&lit_canopy(scene, sources), plan),
            },
            (None, None) => Until::PastTheEnd,
        };
        let alarm = clock.as_ref().and_then(|c| c.alarm(until, &in_time));
        let timed = Run {
            stop: &in_time,
            ..*run
        };
        // a panic must not take the results of the round before with it
        let round = catch_unwind(AssertUnwindSafe(|| {
            resident.solve(canopy, (&lit, &plan), rows, &timed, watch)
        }));
        let round = round.unwrap_or_else(|panic| Err(SolveError::of_panic(&*panic)));
        drop(alarm);
        let (solution, work) = match (round, best) {
            (Ok(done), before) => {
                best = before;
                done
            }
            (Err(error), _) if error.is_distrust() => return Err(error.into()),
            // whoever wants no more does not want the round before either
            (Err(SolveError::Stopped(stopped)), _) if run.stop.check().is_err() => {
                return Err(SolveError::Stopped(stopped).into());
            }
            (Err(SolveError::Stopped(_)), Some(mut before)) => {
                before.accuracy.ended = Ended::OutOfTime;
                return Ok(before);
            }
            (Err(SolveError::Stopped(_)), None) => {
                let needed_s = round_begun.elapsed().as_secs_f64();
                if let (Some(quicker), Some(clock)) = (instead.take(), clock.as_mut()) {
                    clock.learn_at_least(Takes::of(&lit, &plan), needed_s);
                    (sources, plan) = quicker;
                    best = None;
                    continue;
                }
                let limit_s = settings.budget_s.unwrap_or_default();
                return Err(PlanError::Overtime { needed_s, limit_s }.into());
            }
            (Err(error), None) => return Err(error.into()),
            (Err(error), Some(mut before)) => {
                before.accuracy.failure = Some(causes(&error));
                return Ok(before);
            }
        };
        if let Some(clock) = clock.as_mut() {
            let (should, took) = (
                Takes::of(&lit, &plan),
                Takes::of_stages(&watch.stages()[stages_before..]),
            );
            // rows that were there tell nothing of what others take
            let is_traced = work.jobs.traced == 0;
            clock.learn(if is_traced { should.traced() } else { should }, took);
        }
        let reached_percent = worst(&solution.account).map(BandAccount::total_percent);
        rounds.push(Round {
            planned: plan.aims,
            reached_percent,
        });
        let measured = Measured {
            aims: plan.aims,
            coarsest_exchange_percent: plan.coarsest_exchange_percent(&scene.canopy),
            errors: &solution.account,
            fixed: fixed(scene, &plan),
            cost_s: work_s(&WorkCounts::of(&lit, &plan)),
        };
        let choice = Choice {
            scene,
            settings,
            last: (&sources, &plan),
            measured: &measured,
            clock: clock.as_ref(),
        };
        let next = if reached_percent.is_none_or(|reached| reached <= asked) {
            Err(Ended::Reached)
        } else if !settings.in_rounds {
            Err(if plan.is_limited() {
                Ended::BeyondLimits
            } else {
                Ended::NotAsked
            })
        } else if rounds.len() >= MOST_ROUNDS {
            Err(Ended::OutOfRounds)
        } else {
            let finer = measured.finer(asked).ok_or(Ended::NoFiner);
            finer.and_then(|finer| choice.next(&finer))
        };
        let ended = next.as_ref().err().copied().unwrap_or(Ended::Failed);
        let solved = Solved {
            accuracy: Accuracy {
                asked_percent: asked,
                ended,
                rounds: rounds.clone(),
                errors: solution.account.clone(),
                failure: None,
            },
            plan,
            solution,
            work,
        };
        let solved = match best.take() {
            Some(before) => better_of(before, solved),
            None => solved,
        };
        match next {
            Ok(next) => {
                (sources, plan) = next;
                best = Some(solved);
            }
            Err(_) => return Ok(solved),
        }
    }
}

/// The plan that a solve begins with: whatever refuses a solve before anything is computed refuses this.
pub fn first_plan(scene: &Scene, settings: &Settings) -> Result<Plan, RoundsError> {
    let clock = settings.budget_s.map(Clock::start);
    Ok(first(scene, settings, clock.as_ref())?.1)
}

/// The better of two rounds, where a limit shaped the later one: it may have been worse. What ended it all is that of
/// the later one.
fn better_of(before: Solved, after: Solved) -> Solved {
    let reached = |solved: &Solved| worst(&solved.accuracy.errors).map(BandAccount::total_percent);
    if after.plan.is_limited() && reached(&before) < reached(&after) {
        Solved {
            accuracy: Accuracy {
                errors: before.accuracy.errors,
                ..after.accuracy
            },
            ..before
        }
    } else {
        after
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

/// Which parts no plan makes finer.
fn fixed(scene: &Scene, plan: &Plan) -> [bool; PARTS] {
    let AtFinest {
        exchange,
        direct,
        sky,
        elements,
        soil,
    } = plan.at_finest();
    [
        exchange,
        direct,
        scene.light.sky.is_none() || sky,
        elements,
        soil,
    ]
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
        sensors: &scene.sensors,
    }
}
