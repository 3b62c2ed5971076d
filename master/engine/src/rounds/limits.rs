//! What a round is cut down to where memory or time is short: the best that fits is done.

use nestrad_common::light::Sources;
use nestrad_common::scene::Scene;

use super::accuracy::worst;
use super::clock::Clock;
use super::next::Measured;
use super::work::{PerPart, Takes};
use super::{Ended, lit_canopy, sources_for};
use crate::lit_canopy::LitCanopy;
use crate::plan::{Aims, Plan, PlanError, Settings};
use crate::solution::BandAccount;

/// The plan of a round, and its sources.
pub(super) type Planned = (Sources, Plan);

/// What the next round is chosen from.
pub(super) struct Choice<'a> {
    pub(super) scene: &'a Scene,
    pub(super) settings: &'a Settings,
    pub(super) last: (&'a Sources, &'a Plan),
    pub(super) measured: &'a Measured<'a>,
    pub(super) clock: Option<&'a Clock>,
}

/// A round that was cut down is worth its time where it brings the error below this part of the last one's.
const WORTH: f64 = 0.9;

/// Halvings of the way to what would be enough.
const HALVINGS: usize = 7;

/// Why a plan is not carried out.
enum Unfit {
    Memory,
    Time,
    Other,
}

impl Choice<'_> {
    /// The round with errors smaller by these factors, or as near to it as memory and time allow.
    pub(super) fn next(&self, finer: &PerPart) -> Result<Planned, Ended> {
        let aims = self.measured.aims(finer);
        let ended = match self.fits(&aims) {
            Ok(round) => return Ok(round),
            Err(Unfit::Time) => Ended::OutOfTime,
            Err(Unfit::Memory | Unfit::Other) => Ended::BeyondLimits,
        };
        let last = self.measured.aims;
        let candidates = if ended == Ended::OutOfTime {
            vec![self.farthest(|part| self.for_part_of_the_way(part))]
        } else {
            // what memory stands against must not keep it from helping the rest
            let way = |part: f64| last.towards(&aims, part);
            let of_exchange = |part: f64| way(part).with_elements_of(&last);
            let of_elements = |part: f64| Aims {
                exchange_percent: last.exchange_percent,
                ..way(part)
            };
            vec![
                self.farthest(way),
                self.farthest(of_exchange),
                self.farthest(of_elements),
            ]
        };
        let better = |round: &Planned| self.measured.predicted_percent(&round.1.aims);
        let best = candidates
            .into_iter()
            .chain([self.of_asked(&aims)])
            .flatten()
            .min_by(|a, b| better(a).total_cmp(&better(b)));
        let reached = self.measured.predicted_percent(&last);
        best.filter(|round| better(round) < WORTH * reached)
            .ok_or(ended)
    }

    /// The cheapest round for an error between what was reached and what is asked for. It does not depend on what is
    /// asked for but by the time that is left: who asks for more goes the same way, as far or farther.
    fn for_part_of_the_way(&self, part: f64) -> Aims {
        let reached = worst(self.measured.errors).map_or(0.0, BandAccount::total_percent);
        let asked = self.settings.accuracy_percent;
        let target = reached * (asked / reached.max(asked)).powf(part);
        let finer = self.measured.finer(target);
        finer.map_or(self.measured.aims, |finer| self.measured.aims(&finer))
    }

    /// As far on a way as fits.
    fn farthest(&self, way: impl Fn(f64) -> Aims) -> Option<Planned> {
        let (mut low, mut high) = (0.0, 1.0);
        let mut best = self.fits(&way(low)).ok();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            match self.fits(&way(middle)) {
                Ok(round) => (best, low) = (Some(round), middle),
                Err(_) => high = middle,
            }
        }
        best
    }

    /// What is planned without a round before it, with all that takes no memory as fine as it should be.
    fn of_asked(&self, aims: &Aims) -> Option<Planned> {
        let sources = self.sources(aims);
        let lit = lit_canopy(self.scene, &sources);
        let plan = Plan::fitting(&lit, self.settings).ok()?;
        let aims = Aims {
            direct_percent: plan.aims.direct_percent.min(aims.direct_percent),
            sky_percent: aims.sky_percent,
            ..plan.aims
        };
        self.fits(&aims).ok()
    }

    fn sources(&self, aims: &Aims) -> Sources {
        let (sources, last) = self.last;
        if aims.sky_percent < last.aims.sky_percent {
            sources_for(self.scene, aims, self.settings)
        } else {
            sources.clone()
        }
    }

    fn fits(&self, aims: &Aims) -> Result<Planned, Unfit> {
        // planning takes time, too
        if self.clock.is_some_and(Clock::is_over) {
            return Err(Unfit::Time);
        }
        let sources = self.sources(aims);
        let lit = lit_canopy(self.scene, &sources);
        let last = self.last.1;
        let plan = if aims.trace_as(&last.aims) {
            Plan::of_traced(&lit, self.settings, (&last.trace, aims))
        } else {
            Plan::aimed(&lit, self.settings, aims)
        };
        match plan {
            Ok(plan) if self.is_in_time(&lit, &plan) => Ok((sources, plan)),
            Ok(_) => Err(Unfit::Time),
            Err(PlanError::Memory { .. } | PlanError::Elements { .. }) => Err(Unfit::Memory),
            Err(_) => Err(Unfit::Other),
        }
    }

    fn is_in_time(&self, lit: &LitCanopy, plan: &Plan) -> bool {
        let Some(clock) = self.clock else {
            return true;
        };
        let takes = Takes::of(lit, plan);
        clock.allows(if plan.trace == self.last.1.trace {
            takes.traced()
        } else {
            takes
        })
    }
}
