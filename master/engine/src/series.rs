//! One canopy under one light after the other.
//!
//! How the canopy is traced, and how finely its light is computed, is chosen once, by a light that stands for all of
//! them; so a light gives the same bits whatever came before it.

use nestrad_common::light::Light;
use nestrad_common::scene::Scene;

use crate::exchange::RowSource;
use crate::lit_canopy::LitCanopy;
use crate::plan::{Aims, Plan, Settings, TracePlan};
use crate::resident::Resident;
use crate::rounds::{Round, RoundsError, Solved, light_in_rounds};
use crate::run::Run;
use crate::solution::Solution;
use crate::stopwatch::Stopwatch;
use crate::traced::WorkDone;

/// A canopy that was traced for a series of lights.
pub struct Series {
    /// Its light is that of the choice.
    scene: Scene,
    settings: Settings,
    trace: TracePlan,
    aims: Aims,
    resident: Resident,
}

const GIB: f64 = (1u64 << 30) as f64;

impl Series {
    /// Traces a canopy as finely as its light asks for, in rounds where an accuracy was asked for. What comes of this
    /// light is given back too.
    pub fn begin(
        scene: Scene,
        settings: Settings,
        rows: &dyn RowSource,
        run: &Run,
        watch: &mut Stopwatch,
        begins: impl FnMut(&Plan, &[Round]),
    ) -> Result<(Self, Solved), RoundsError> {
        let mut resident = Resident::within((settings.memory_GiB * GIB) as u64);
        let canopy = (&scene, &mut resident);
        let solved = light_in_rounds(canopy, &settings, rows, run, watch, begins)?;
        let series = Self {
            settings,
            trace: solved.plan.trace.clone(),
            aims: solved.plan.aims,
            scene,
            resident,
        };
        Ok((series, solved))
    }

    /// Lights the canopy. Rows are traced again only where memory did not hold them.
    pub fn lit(
        &mut self,
        light: &Light,
        rows: &dyn RowSource,
        run: &Run,
        watch: &mut Stopwatch,
    ) -> Result<(Solution, WorkDone), RoundsError> {
        let sources = light.sources(self.aims.sky_directions(), self.settings.seed);
        let lit = LitCanopy {
            canopy: &self.scene.canopy,
            optics: &self.scene.optics,
            sources: &sources,
            sensors: &self.scene.sensors,
        };
        let plan = Plan::of_traced(&lit, &self.settings, (&self.trace, &self.aims))?;
        let canopy = (&self.scene.canopy, &self.settings);
        Ok(self
            .resident
            .solve(canopy, (&lit, &plan), rows, run, watch)?)
    }

    /// Bytes that the canopy takes.
    pub fn bytes(&self) -> u64 {
        self.resident.bytes()
    }
}
