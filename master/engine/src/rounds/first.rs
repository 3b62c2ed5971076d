//! The first round: what is asked for, or a coarse look where that saves; or the best that memory and time allow.

use nestrad_common::light::Sources;
use nestrad_common::scene::Scene;

use super::clock::Clock;
use super::limits::Planned;
use super::work::{Takes, work_s};
use super::{lit_canopy, sources_for};
use crate::plan::{
    Aims, DEFAULT_ACCURACY_PERCENT, LEAST_ACCURACY_PERCENT, Plan, PlanError, Settings, WorkCounts,
};

/// A coarse look comes first where it takes less than this part of what is planned without one.
const WORTH_A_LOOK: f64 = 0.2;

/// The plan of the first round, with its sources.
pub(super) fn first(
    scene: &Scene,
    settings: &Settings,
    clock: Option<&Clock>,
) -> Result<Planned, PlanError> {
    if let Some(clock) = clock {
        return in_time(scene, settings, clock);
    }
    let aims = Aims::of(settings.accuracy_percent);
    let sources = sources_for(scene, &aims, settings);
    let plan = Plan::fitting(&lit_canopy(scene, &sources), settings);
    if !settings.in_rounds {
        return Ok((sources, plan?));
    }
    let aims = Aims::pilot(settings.accuracy_percent);
    let coarse = sources_for(scene, &aims, settings);
    let look = Plan::aimed(&lit_canopy(scene, &coarse), settings, &aims);
    let takes_s = |sources, plan| {
        let counts = WorkCounts::of(&lit_canopy(scene, sources), plan);
        work_s(&counts).iter().sum::<f64>()
    };
    match (plan, look) {
        // it may not need as much as it was planned with
        (Ok(plan), Ok(look))
            if takes_s(&coarse, &look) < WORTH_A_LOOK * takes_s(&sources, &plan) =>
        {
            Ok((coarse, look))
        }
        (plan, _) => Ok((sources, plan?)),
    }
}

/// Where time is short: what is asked for, or the finest plan that should leave time for another, which is planned by
/// what this one measures.
fn in_time(scene: &Scene, settings: &Settings, clock: &Clock) -> Result<Planned, PlanError> {
    let asked = settings.accuracy_percent;
    let planned = |aims: &Aims| planned(scene, settings, aims);
    let allows = |(sources, plan): &Planned| clock.allows_first(&lit_canopy(scene, sources), plan);
    let wanted = planned(&Aims::of(asked))?;
    if allows(&wanted) {
        return Ok(wanted);
    }
    // the same steps whatever is asked for, so that who asks for more is not given less
    let steps = |coarsest: f64, finest: f64| {
        move |part: f64| Aims::of((coarsest * (finest / coarsest).powf(part)).max(asked))
    };
    if asked < DEFAULT_ACCURACY_PERCENT {
        let usual = planned(&Aims::of(DEFAULT_ACCURACY_PERCENT))?;
        if allows(&usual) {
            let step = steps(DEFAULT_ACCURACY_PERCENT, LEAST_ACCURACY_PERCENT);
            return finest(usual, allows, |part| planned(&step(part)));
        }
    }
    let look = planned(&Aims::pilot(asked))?;
    if allows(&look) {
        let step = steps(COARSE_PERCENT, DEFAULT_ACCURACY_PERCENT);
        return finest(look, allows, |part| planned(&step(part)));
    }
    let best = quickest(scene, settings)?;
    if allows(&best) {
        let pilot = Aims::pilot(asked);
        return finest(best, allows, |part| {
            planned(&pilot.quicker(QUICKEST.powf(1.0 - part)))
        });
    }
    let (sources, plan) = &best;
    let lit = lit_canopy(scene, sources);
    if clock.allows_coarsest(&lit, plan) {
        Ok(best)
    } else {
        Err(PlanError::Time {
            needed_s: clock.takes_s(Takes::of(&lit, plan)),
            limit_s: settings.budget_s.unwrap_or_default(),
        })
    }
}

/// The last plan of a row, from the coarsest at 0 to the finest at 1, that is allowed; the first one is.
fn finest(
    coarsest: Planned,
    allows: impl Fn(&Planned) -> bool,
    planned: impl Fn(f64) -> Result<Planned, PlanError>,
) -> Result<Planned, PlanError> {
    let (mut low, mut high) = (0.0, 1.0);
    let mut best = coarsest;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let tried = planned(middle)?;
        if allows(&tried) {
            (best, low) = (tried, middle);
        } else {
            high = middle;
        }
    }
    Ok(best)
}

/// The plan of the coarsest look.
fn quickest(scene: &Scene, settings: &Settings) -> Result<Planned, PlanError> {
    let pilot = Aims::pilot(settings.accuracy_percent);
    planned(scene, settings, &pilot.quicker(QUICKEST))
}

fn planned(scene: &Scene, settings: &Settings, aims: &Aims) -> Result<Planned, PlanError> {
    let sources = sources_for(scene, aims, settings);
    let plan = Plan::fitting_aims(&lit_canopy(scene, &sources), settings, aims)?;
    Ok((sources, plan))
}

/// What is begun in place of a first round that takes far longer than it should, if there is something that is
/// quicker by much: this machine is slower than it was taken for, or others use it too.
pub(super) fn in_place_of(
    (sources, plan): (&Sources, &Plan),
    scene: &Scene,
    settings: &Settings,
) -> Option<Planned> {
    let quickest = quickest(scene, settings).ok()?;
    let takes_s = |sources, plan| Takes::of(&lit_canopy(scene, sources), plan).all_s();
    let is_quicker = takes_s(&quickest.0, &quickest.1) < MUCH_QUICKER * takes_s(sources, plan);
    is_quicker.then_some(quickest)
}

/// Part of a plan's time that a much quicker one takes at most.
const MUCH_QUICKER: f64 = 0.6;

/// No look is coarser than another by more than this.
const QUICKEST: f64 = 20.0;

/// A look is not coarser than for this error, percent, where there is time.
const COARSE_PERCENT: f64 = 2.0;

/// Halvings of the way: a plan takes time, too.
const HALVINGS: usize = 5;
