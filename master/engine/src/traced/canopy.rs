//! The canopy as it was traced: its frame, and what its faces see of each other.

use nestrad_common::canopy::Canopy;

use super::at_once::at_once;
use super::scattering::{Far, Scattering};
use crate::direct::KeptDirections;
use crate::exchange::{Exchange, Outlook, RowSource};
use crate::frame::Frame;
use crate::heap::Freed;
use crate::plan::TracePlan;
use crate::run::Run;
use crate::solve_error::SolveError;
use crate::solver::Groups;
use crate::stopwatch::Stopwatch;

/// A canopy in its frame, with what its faces see of each other.
pub struct TracedCanopy {
    pub(super) frame: Frame,
    pub(super) scattering: Option<Scattering>,
    /// What directions lighted it so far.
    pub(super) directions: KeptDirections,
}

/// The name of a stage whose time a budget is reckoned by.
pub(crate) const STAGE_EXCHANGE: &str = "exchange";

impl TracedCanopy {
    /// Traces a canopy as planned.
    pub fn trace(
        canopy: &Canopy,
        plan: &TracePlan,
        rows: &dyn RowSource,
        run: &Run,
    ) -> Result<Self, SolveError> {
        Self::trace_frame(Frame::new(canopy, &plan.cut())?, plan, rows, run)
    }

    /// Traces a canopy in a frame that was made for it.
    pub fn trace_frame(
        frame: Frame,
        plan: &TracePlan,
        rows: &dyn RowSource,
        run: &Run,
    ) -> Result<Self, SolveError> {
        let watch = &mut Stopwatch::start();
        let (traced, ()) = Self::of_frame(frame, plan, (rows, run, watch), |_, _, _| Ok(()))?;
        Ok(traced)
    }

    /// Traces a canopy in its frame. Where rows are traced elsewhere, this process does `meanwhile` at the same
    /// time, else before; it has a frame, and is watched.
    pub fn of_frame<T>(
        frame: Frame,
        plan: &TracePlan,
        (rows, run, watch): (&dyn RowSource, &Run, &mut Stopwatch),
        meanwhile: impl FnOnce(&Frame, &Run, &mut Stopwatch) -> Result<T, SolveError>,
    ) -> Result<(Self, T), SolveError> {
        let here = |run: &Run, watch: &mut Stopwatch| {
            let done = meanwhile(&frame, run, watch)?;
            let far = Far::trace(&frame, plan, run)?;
            if plan.sampling.is_some() {
                watch.lap("far field");
            }
            Ok((done, far))
        };
        let there = |run: &Run| match &plan.sampling {
            Some(sampling) => Ok(Some(Exchange::trace(&frame, sampling, rows, run)?)),
            None => Ok(None),
        };
        let is_elsewhere = rows.is_elsewhere() && plan.sampling.is_some() && !plan.in_turn;
        let ((done, far), exchange) = if is_elsewhere {
            at_once(run, |run| here(run, watch), there)?
        } else {
            (here(run, watch)?, there(run)?)
        };
        if frame.rows() > MANY_ROWS {
            Freed::default().give_back();
        }
        let scattering = exchange.map(|exchange| Scattering {
            outlook: Outlook::of(&frame, &exchange),
            exchange,
            groups: Groups::of(&frame),
            far,
        });
        watch.lap(STAGE_EXCHANGE);
        let traced = Self {
            frame,
            scattering,
            directions: KeptDirections::default(),
        };
        Ok((traced, done))
    }

    /// The same with what directions light it by.
    pub(crate) fn keeping(mut self, directions: KeptDirections) -> Self {
        self.directions = directions;
        self
    }

    /// Bytes that it takes, with the directions that are kept.
    pub fn bytes(&self) -> u64 {
        let scattering = self.scattering.as_ref().map_or(0, Scattering::bytes);
        self.frame.bytes() + scattering + self.directions.bytes()
    }

    /// The canopy in its frame.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// What its faces see of each other; none where nothing was to be scattered.
    pub fn exchange(&self) -> Option<&Exchange> {
        self.scattering.as_ref().map(|s| &s.exchange)
    }
}

/// With more rows than this, memory that tracing has freed is given back before the solver takes its own: 280 MB of
/// 2.8 GB for a million triangles. It takes milliseconds, which a small canopy does not.
const MANY_ROWS: usize = 100_000;
