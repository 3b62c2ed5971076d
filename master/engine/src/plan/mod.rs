//! The plan: what a scene needs, decided before anything is computed. What is not needed costs
//! nothing.

mod aims;
mod counts;
mod density;
mod elements;
mod entries;
mod error;
mod finest;
mod fitting;
mod limits;
mod memory;
mod reasons;
mod sampling;
mod scale;

use std::sync::Arc;

use nestrad_common::canopy::Canopy;
use nestrad_common::light::Sources;
use nestrad_common::options::{DEFAULT_MEMORY_GIB, Diameter, Scatter};
use nestrad_kernel::elements::Elements;
use nestrad_kernel::far_grid::{Levels, SharedFarGrid};
use nestrad_kernel::lattice::Extent;
use serde::Serialize;

use crate::direct;
use crate::exchange::{FarSampling, Sampling};
use crate::frame::Cut;
use crate::lit_canopy::LitCanopy;
use crate::solver::Tolerance;
pub use aims::Aims;
pub use counts::WorkCounts;
pub use entries::Entries;
pub use error::PlanError;
pub use finest::AtFinest;
pub use limits::LEAST_ACCURACY_PERCENT;
pub use memory::Memory;
pub use scale::Scale;

/// What the user asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Settings {
    /// Diameter of the sphere of near exchange.
    pub diameter: Diameter,
    /// Standard error to aim at: rms over organs, in percent of the mean absorbed power per area.
    pub accuracy_percent: f64,
    /// Whether there are rounds until that is reached. Without them the plan depends on the scene alone, so that the
    /// exchange of one solve serves another under other lights.
    pub in_rounds: bool,
    /// Seconds that the solve may take; what is reached by then has to do. Results then depend on how fast the
    /// machine is.
    pub budget_s: Option<f64>,
    /// Memory that the solve may take, GiB.
    pub memory_GiB: f64,
    /// Start of all random numbers.
    pub seed: u64,
    /// How the exchange is sampled.
    pub estimator: Estimator,
    /// Whether light is followed after it was scattered.
    pub scatter: Scatter,
}

/// How the exchange is sampled.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Estimator {
    /// Parallel lines, completed with rays where they are thin.
    #[default]
    Lines,
    /// Rays from every face: slower, and independent of the lines.
    Rays,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            diameter: Diameter::Auto,
            accuracy_percent: DEFAULT_ACCURACY_PERCENT,
            in_rounds: false,
            budget_s: None,
            memory_GiB: DEFAULT_MEMORY_GIB,
            seed: 1,
            estimator: Estimator::default(),
            scatter: Scatter::default(),
        }
    }
}

/// The accuracy that the constants of the plan were measured at.
pub const DEFAULT_ACCURACY_PERCENT: f64 = 0.5;

/// What will be done, and why.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// What its parts are to err by.
    pub aims: Aims,
    /// The scene's sizes.
    pub scale: Scale,
    /// How the canopy is traced, whatever the light.
    #[serde(flatten)]
    pub trace: TracePlan,
    /// How it is lit.
    #[serde(flatten)]
    pub light: LightPlan,
    /// Memory that it will take.
    pub memory: Memory,
    /// One line each: what, and the reason.
    pub reasons: Vec<String>,
}

/// How a canopy is traced.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TracePlan {
    /// Longest edge of an element, metres.
    pub max_edge_m: f64,
    /// Side of a soil cell, metres, about.
    pub soil_cell_m: f64,
    /// Radius of the sphere of near exchange, metres; `None` for plain radiosity.
    pub radius_m: Option<f64>,
    /// The far field; `None` where nothing is far.
    pub far_field: Option<FarPlan>,
    /// Sampling of the exchange; `None` when nothing scatters, or what is scattered is not followed.
    pub sampling: Option<Sampling>,
    /// Whether memory allows no direct light while rows are traced elsewhere.
    #[serde(skip)]
    pub in_turn: bool,
}

/// How finely the far field is resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct FarPlan {
    /// Levels, evenly spaced from the bottom to the top of the scene; at least 2.
    pub levels: u32,
    /// Bins per hemisphere, uniform in the cosine of the zenith angle.
    pub bins: u32,
    /// The lines that it is the mean over.
    #[serde(flatten)]
    pub sampling: FarSampling,
}

/// How a traced canopy is lit.
#[derive(Clone, Debug, Serialize)]
pub struct LightPlan {
    /// Cross-section of a line of the strongest source, m².
    pub direct_line_area_m2: f64,
    /// Start of the random numbers of the direct light.
    pub seed: u64,
    /// Numbers of the bands in which something scatters that is followed.
    pub scattering_bands: Vec<usize>,
    /// When the solver stops.
    pub tolerance: Tolerance,
    /// See [`Scale::ground_area_m2`].
    #[serde(skip)]
    pub ground_area_m2: f64,
    /// See [`Scale::area_m2`].
    #[serde(skip)]
    pub leaf_area_m2: f64,
}

impl LightPlan {
    /// Cross-sections of the lines of each source, m², through a scene of that extent.
    pub fn line_areas_m2(&self, extent: &Extent, sources: &Sources) -> Vec<f64> {
        let finest_m2 = self.direct_line_area_m2;
        let areas_m2 = (self.ground_area_m2, self.leaf_area_m2);
        direct::spread_effort(sources, extent, finest_m2, areas_m2)
    }
}

impl TracePlan {
    /// How the canopy is cut, and what its far field is.
    pub fn cut(&self) -> Cut {
        let levels = self.far_field.map(|far| Levels {
            levels: far.levels,
            bins: far.bins,
        });
        Cut {
            max_edge_m: self.max_edge_m,
            soil_cell_m: self.soil_cell_m,
            radius_m: self.radius_m.unwrap_or(f64::INFINITY),
            far: levels.map(|grid| Arc::new(grid) as SharedFarGrid),
        }
    }
}

impl Plan {
    /// Decides what a lit canopy needs for the accuracy of the settings.
    pub fn new(lit: &LitCanopy, settings: &Settings) -> Result<Self, PlanError> {
        let scale = Scale::of(lit.canopy);
        Self::of_scale(lit, settings, &asked(lit.canopy, settings, &scale), scale)
    }

    /// The same with an error to aim at for each part, in place of the accuracy.
    pub fn aimed(lit: &LitCanopy, settings: &Settings, aims: &Aims) -> Result<Self, PlanError> {
        Self::of_scale(lit, settings, aims, Scale::of(lit.canopy))
    }

    fn of_scale(
        lit: &LitCanopy,
        settings: &Settings,
        aims: &Aims,
        scale: Scale,
    ) -> Result<Self, PlanError> {
        let LitCanopy {
            canopy,
            optics,
            sources,
            ..
        } = *lit;
        limits::check_accuracy(aims.exchange_percent.min(aims.direct_percent))?;
        limits::check_overhang(canopy)?;
        limits::check_height(&scale)?;
        limits::check_pattern(canopy, &scale)?;
        let has_soil = canopy.soil_z_m.is_some();
        let is_lit = |b: usize| sources.list.iter().any(|s| s.irradiance_W_m2[b] > 0.0);
        let scatters = |&b: &usize| is_lit(b) && !optics.bands[b].is_black(has_soil);
        let scattering_bands: Vec<usize> = match settings.scatter {
            Scatter::All => (0..optics.len()).filter(scatters).collect(),
            Scatter::None => Vec::new(),
        };
        let organ_m = scale.organ_m();
        let edge_m = elements::edge_m(&scale);
        let coarser = aims.coarser_elements();
        let elements = Elements::count(canopy.corners_m(), edge_m * coarser);
        let sampling = (!scattering_bands.is_empty())
            .then(|| sampling::lines(canopy, &scale, elements, settings, aims));
        // an open scene has no layers that go on for ever; its exchange is full
        let radius_m = match settings.diameter {
            Diameter::Metres(d) if canopy.pattern.is_some() => Some(0.5 * d),
            Diameter::Metres(_) | Diameter::Auto | Diameter::Infinite => None,
        };
        // a sphere longer than every line of sight is no bound
        let radius_m =
            radius_m.filter(|&r| sampling.is_some_and(|s| r < s.longest_sight_m(scale.height_m)));
        let finer = aims.exchange_percent / DEFAULT_ACCURACY_PERCENT;
        let of_direct = aims.direct_percent / DEFAULT_ACCURACY_PERCENT;
        let edge_m = edge_m.min(radius_m.map_or(f64::INFINITY, |r| r.max(organ_m / FINEST_CUT)));
        let max_edge_m = edge_m * coarser;
        let soil_cell_m = (0.2 * organ_m * aims.coarser_soil_cells()).clamp(
            smallest_soil_cell_m(&scale),
            (scale.ground_area_m2 / LEAST_SOIL_CELLS)
                .sqrt()
                .max(f64::MIN_POSITIVE),
        );
        // points on the outline of an organ: see `spread_effort`
        let direct_line_area_m2 = (scale.organ_area_m2 / 10_000.0 * of_direct.powf(4.0 / 3.0))
            .min(scale.triangle_area_m2 / 4.0)
            .min(max_edge_m * max_edge_m / EDGE_SQUARED_IN_POINTS)
            .clamp(
                scale.ground_area_m2 / most_points(canopy, of_direct),
                scale.ground_area_m2 / 1e4,
            )
            .max(f64::MIN_POSITIVE);
        let plan = Self {
            // what is not cut is as good as cut to its size
            aims: aims.with_elements_at_most(scale.triangle_edge_m / edge_m),
            scale,
            trace: TracePlan {
                max_edge_m,
                soil_cell_m,
                radius_m,
                far_field: radius_m.map(|_| sampling::far_field(settings, finer)),
                sampling,
                in_turn: false,
            },
            light: LightPlan {
                direct_line_area_m2,
                seed: settings.seed,
                scattering_bands,
                tolerance: Tolerance {
                    absorbed: (1e-4 * finer).clamp(1e-9, 1e-3),
                    most_passes: 500,
                },
                ground_area_m2: scale.ground_area_m2,
                leaf_area_m2: scale.area_m2,
            },
            memory: Memory::default(),
            reasons: Vec::new(),
        };
        let mut plan = plan.within(lit, settings.memory_GiB)?;
        plan.reasons = reasons::of(lit, settings, &plan);
        Ok(plan)
    }

    /// The plan for another light of a canopy that was traced by such a plan, for these aims.
    pub fn of_traced(
        lit: &LitCanopy,
        settings: &Settings,
        (trace, aims): (&TracePlan, &Aims),
    ) -> Result<Self, PlanError> {
        let own = Self::aimed(lit, settings, aims)?;
        let plan = Self {
            trace: trace.clone(),
            aims: *aims,
            ..own
        };
        let mut plan = plan.within(lit, settings.memory_GiB)?;
        plan.reasons = reasons::of(lit, settings, &plan);
        Ok(plan)
    }

    /// The plan as it is after its fields were changed, with the memory that it takes now, or why there is not
    /// enough of it. Its reasons are gone: they were those of the plan before the change.
    pub fn within(mut self, lit: &LitCanopy, memory_GiB: f64) -> Result<Self, PlanError> {
        limits::check_elements(lit.canopy, self.trace.max_edge_m)?;
        self.memory = Memory::of(lit, &self);
        self.trace.in_turn = Memory::of_at_once(lit, &self).total_GiB() > memory_GiB;
        self.reasons.clear();
        if self.memory.total_GiB() <= memory_GiB {
            return Ok(self);
        }
        Err(PlanError::Memory {
            needed: self.memory,
            limit_GiB: memory_GiB,
        })
    }

    /// Planning the exchange for a larger error than this makes it no coarser.
    pub fn coarsest_exchange_percent(&self, canopy: &Canopy) -> f64 {
        if self.aims.thin {
            f64::INFINITY
        } else {
            sampling::coarsest_percent(canopy, &self.scale)
        }
    }
}

/// What is aimed at where nothing stands against it.
fn asked(canopy: &Canopy, settings: &Settings, scale: &Scale) -> Aims {
    if settings.in_rounds {
        in_rounds(canopy, settings.accuracy_percent, scale)
    } else {
        Aims::of(settings.accuracy_percent)
    }
}

/// What the first round for an accuracy aims at.
fn in_rounds(canopy: &Canopy, accuracy_percent: f64, scale: &Scale) -> Aims {
    let aims = Aims::of(accuracy_percent);
    let aims = elements::fine_enough(aims, accuracy_percent, scale);
    sampling::with_a_margin(aims, canopy, scale)
}

/// An organ of average size is not cut finer than into this many along a side, however small the sphere.
const FINEST_CUT: f64 = 24.0;

fn smallest_soil_cell_m(scale: &Scale) -> f64 {
    (scale.ground_area_m2 / MOST_SOIL_CELLS).sqrt()
}

/// Soil cells, at most and at least.
const MOST_SOIL_CELLS: f64 = 1e6;
const LEAST_SOIL_CELLS: f64 = 64.0;

/// Lattice points of the strongest source, at most: some, and what a canopy of a tenth of a square metre
/// of leaf per square metre asks for. What is too small for them is probed with rays.
fn most_points(canopy: &Canopy, finer: f64) -> f64 {
    let of_organs = 10_000.0 * canopy.organs.len() as f64 / finer.powf(4.0 / 3.0);
    (1e6 + 10.0 * (of_organs + 4.0 * canopy.len() as f64)).min(MOST_DIRECT_LINES)
}

/// Never more than this.
const MOST_DIRECT_LINES: f64 = 3e8;

/// An element of full size is met by half as many points as this, so that it is lit as it should be.
const EDGE_SQUARED_IN_POINTS: f64 = 32.0;
