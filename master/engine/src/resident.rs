//! A canopy that stays: what was traced of it serves one light after the other.

use std::sync::Arc;

use nestrad_common::canopy::Canopy;

use crate::direct::KeptDirections;
use crate::exchange::{JobCounts, RowSource};
use crate::lit_canopy::LitCanopy;
use crate::plan::{Aims, Plan, Settings, TracePlan};
use crate::run::Run;
use crate::solution::Solution;
use crate::stopwatch::Stopwatch;
use crate::traced::{SolveError, TracedCanopy, WorkDone, solve_and_keep};

/// Room for one canopy. What is resident saves time and changes no result: a light gives the same bits as it does
/// alone by the same plan.
pub struct Resident {
    most_bytes: u64,
    keeps_directions: bool,
    goes_on: bool,
    held: Option<Held>,
}

const GIB: f64 = (1u64 << 30) as f64;

/// A canopy, and how it was traced.
struct Held {
    canopy: Arc<Canopy>,
    settings: Settings,
    plan: TracePlan,
    aims: Aims,
    traced: TracedCanopy,
}

impl Held {
    fn bytes(&self) -> u64 {
        self.canopy.bytes() + self.traced.bytes()
    }
}

impl Resident {
    /// Holds a canopy that takes so many bytes at most, directions of light included.
    pub fn within(most_bytes: u64) -> Self {
        Self {
            most_bytes,
            keeps_directions: true,
            goes_on: false,
            held: None,
        }
    }

    /// The same, where rounds begin as finely as the canopy was traced for the lights before: other lights hardly ever
    /// trace anything, but where one has made it finer, the next has other bits than it would have alone.
    #[must_use]
    pub fn going_on(self) -> Self {
        Self {
            goes_on: true,
            ..self
        }
    }

    /// Holds a canopy from one round to the next, which may need finer light alone.
    pub(crate) fn between_rounds() -> Self {
        Self {
            most_bytes: u64::MAX,
            keeps_directions: false,
            goes_on: false,
            held: None,
        }
    }

    /// Lets go of what is held.
    pub(crate) fn forget(&mut self) {
        self.held = None;
    }

    /// Bytes that are held, with the canopy as it was read.
    pub fn bytes(&self) -> u64 {
        self.held.as_ref().map_or(0, Held::bytes)
    }

    /// How the canopy was traced and for what, if rounds by these settings go on from there.
    pub(crate) fn goes_on_with(
        &self,
        canopy: &Arc<Canopy>,
        settings: &Settings,
    ) -> Option<(&TracePlan, &Aims)> {
        let held = self.held.as_ref()?;
        let own = Settings {
            budget_s: settings.budget_s,
            memory_GiB: settings.memory_GiB,
            ..held.settings
        };
        let goes_on = self.goes_on && settings.in_rounds;
        let fits = goes_on && is_same(&held.canopy, canopy) && own == *settings;
        fits.then_some((&held.plan, &held.aims))
    }

    /// Lights a canopy as planned, and traces it where it is not resident, or was traced by another plan.
    pub(crate) fn solve(
        &mut self,
        (canopy, settings): (&Arc<Canopy>, &Settings),
        (lit, plan): (&LitCanopy, &Plan),
        rows: &dyn RowSource,
        run: &Run,
        watch: &mut Stopwatch,
    ) -> Result<(Solution, WorkDone), SolveError> {
        let fits = |held: &Held| {
            // when direct light is computed changes nothing of what was traced
            let in_turn = held.plan.in_turn;
            let trace = &plan.trace;
            is_same(&held.canopy, canopy)
                && held.plan
                    == TracePlan {
                        in_turn,
                        ..trace.clone()
                    }
        };
        if let Some(held) = self.held.as_ref().filter(|held| fits(held)) {
            let (optics, light) = (lit.optics, (lit.sources, lit.sensors));
            let lit = held
                .traced
                .lit_watched(optics, light, &plan.light, run, watch);
            let (solution, mut work) = lit?;
            work.jobs = JobCounts {
                traced: 0,
                kept: work.jobs.traced + work.jobs.kept,
            };
            return Ok((solution, work));
        }
        // there is not to be room for two
        self.held = None;
        let directions = if self.keeps_directions {
            let of_canopy = GIB * plan.memory.total_GiB();
            KeptDirections::within(self.most_bytes.saturating_sub(of_canopy as u64))
        } else {
            KeptDirections::default()
        };
        let (solution, work, traced) = solve_and_keep(lit, plan, (rows, run, watch), directions)?;
        let held = Held {
            canopy: canopy.clone(),
            settings: *settings,
            plan: plan.trace.clone(),
            aims: plan.aims,
            traced,
        };
        self.held = (held.bytes() <= self.most_bytes).then_some(held);
        Ok((solution, work))
    }
}

/// A canopy that was sent or read again is the same one.
fn is_same(a: &Arc<Canopy>, b: &Arc<Canopy>) -> bool {
    Arc::ptr_eq(a, b) || a == b
}
