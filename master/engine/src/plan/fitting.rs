//! The finest plan that fits: where memory is short, what takes it is coarser than what was asked for.

use super::{Aims, LEAST_ACCURACY_PERCENT, Plan, PlanError, Scale, Settings, asked, in_rounds};
use crate::lit_canopy::LitCanopy;

/// No plan is coarser than for this error, percent.
const COARSEST_PERCENT: f64 = 100.0;

/// Halvings of the way from the finest plan to it: to half a per cent of the error that is planned for.
const HALVINGS: usize = 11;

impl Plan {
    /// For the accuracy of the settings, or as near to it as memory allows.
    pub fn fitting(lit: &LitCanopy, settings: &Settings) -> Result<Self, PlanError> {
        let scale = Scale::of(lit.canopy);
        let aims = asked(lit.canopy, settings, &scale);
        Self::fitting_of(lit, settings, &aims, scale)
    }

    /// For these aims, or as near to them as memory allows.
    pub fn fitting_aims(
        lit: &LitCanopy,
        settings: &Settings,
        aims: &Aims,
    ) -> Result<Self, PlanError> {
        Self::fitting_of(lit, settings, aims, Scale::of(lit.canopy))
    }

    fn fitting_of(
        lit: &LitCanopy,
        settings: &Settings,
        aims: &Aims,
        scale: Scale,
    ) -> Result<Self, PlanError> {
        match Self::of_scale(lit, settings, aims, scale) {
            Err(error) if error.is_of_size() => {}
            done => return done,
        }
        finest(|percent| {
            let aims = aims.with_memory_of(&in_rounds(lit.canopy, percent, &scale));
            Self::of_scale(lit, settings, &aims, scale)
        })
    }

    /// Whether something is coarser than it would be if no limit were short.
    pub fn is_limited(&self) -> bool {
        self.aims.thin
    }
}

/// The plan for the smallest error that is not too large. Larger errors are taken to give smaller plans.
fn finest(planned: impl Fn(f64) -> Result<Plan, PlanError>) -> Result<Plan, PlanError> {
    let (mut low, mut high) = (0.0, 1.0);
    let ratio = COARSEST_PERCENT / LEAST_ACCURACY_PERCENT;
    let at = |part: f64| planned(LEAST_ACCURACY_PERCENT * f64::powf(ratio, part));
    let mut best = at(high)?;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match at(middle) {
            Ok(plan) => (best, high) = (plan, middle),
            Err(error) if error.is_of_size() => low = middle,
            Err(error) => return Err(error),
        }
    }
    Ok(best)
}
