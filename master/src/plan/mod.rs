//! The plan: what a scene needs, decided before anything is computed. What is not needed costs
//! nothing.

mod aims;
mod counts;
mod density;
mod elements;
mod limits;
mod memory;
mod reasons;
mod sampling;
mod scale;

use std::fmt;

use nestrad_common::elements::Elements;
use nestrad_common::options::Diameter;
use nestrad_common::problem::Problem;
use serde::Serialize;
use thiserror::Error;

use crate::direct;
use crate::exchange::Sampling;
use crate::far_field::closure::Resolution;
use crate::solver::Tolerance;
use crate::world::{World, extent_of};
pub use aims::Aims;
pub use counts::Counts;
pub use memory::Memory;
pub(crate) use sampling::DRAWN_NS;
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
            memory_GiB: 8.0,
            seed: 1,
            estimator: Estimator::default(),
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
    /// Longest edge of an element, metres.
    pub max_edge_m: f64,
    /// Side of a soil cell, metres, about.
    pub soil_cell_m: f64,
    /// Radius of the sphere of near exchange, metres; `None` for plain radiosity.
    pub radius_m: Option<f64>,
    /// The far field; `None` where nothing is far.
    pub far_field: Option<Resolution>,
    /// Sampling of the exchange; `None` when nothing scatters.
    pub sampling: Option<Sampling>,
    /// Cross-section of a line of the strongest source, m².
    pub direct_line_area_m2: f64,
    /// Start of the random numbers of the direct light.
    pub seed: u64,
    /// Numbers of the bands in which something scatters.
    pub scattering_bands: Vec<usize>,
    /// When the solver stops.
    pub tolerance: Tolerance,
    /// Memory that it will take.
    pub memory: Memory,
    /// One line each: what, and the reason.
    pub reasons: Vec<String>,
}

/// Why no plan can be made.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PlanError {
    /// It does not fit.
    #[error(
        "the solve needs about {:.2} GiB (scene {:.2}, rows {:.2}, solver {:.2}), the limit is {} GiB: raise --memory or --accuracy",
        .needed.total_GiB(), .needed.scene_GiB, .needed.rows_GiB, .needed.solver_GiB, Short(*.limit_GiB)
    )]
    Memory {
        /// What the smallest plan for this accuracy takes.
        needed: Memory,
        /// What the user allows.
        limit_GiB: f64,
    },
    /// More accuracy than there are directions for.
    #[error("accuracy: expected at least {least} %, found {} %", Short(*.found))]
    Accuracy {
        /// The least that can be asked for.
        least: f64,
        /// As given.
        found: f64,
    },
    /// A triangle that covers its own copies.
    #[error(
        "triangle {triangle} (from 0) reaches over {patterns:.1e} copies of the pattern, expected at most {most:.0e}: is the unit right?"
    )]
    Overhang {
        /// Its number.
        triangle: usize,
        /// Copies of the pattern that it reaches into.
        patterns: f64,
        /// Most copies.
        most: f64,
    },
    /// A pattern that light crosses too often on its way.
    #[error(
        "the scene, soil included, is {height_m:.1e} m high on a pattern {width_m:.1e} m wide, expected at most {most} times as high as wide: are the unit and the height of the soil right?"
    )]
    Narrow {
        /// From the lowest to the highest point.
        height_m: f64,
        /// The shorter side of the pattern.
        width_m: f64,
        /// Most times as high as wide.
        most: f64,
    },
    /// Leaves that cannot be told apart in height.
    #[error(
        "the scene, soil included, is {height_m:.3e} m high, which resolves heights to {step_m:.1e} m only, against triangles of {triangle_m:.1e} m: is the height of the soil right?"
    )]
    Height {
        /// From the lowest to the highest point.
        height_m: f64,
        /// A step in depth along the vertical.
        step_m: f64,
        /// Root of the area of a triangle.
        triangle_m: f64,
    },
    /// More elements than can be numbered.
    #[error(
        "triangles would be cut into {found} elements, expected at most {most}: raise --diameter or --accuracy"
    )]
    Elements {
        /// How many there would be.
        found: u64,
        /// How many can be numbered.
        most: u64,
    },
}

/// A number without a row of zeros.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if (1e-3..1e6).contains(&self.0) {
            self.0.fmt(f)
        } else {
            write!(f, "{:e}", self.0)
        }
    }
}

impl Plan {
    /// Decides what a problem needs for the accuracy of the settings.
    pub fn new(problem: &Problem, settings: &Settings) -> Result<Self, PlanError> {
        let scale = Scale::of(problem);
        let mut aims = Aims::of(settings.accuracy_percent);
        if settings.in_rounds {
            aims = elements::fine_enough(aims, settings.accuracy_percent, &scale);
            aims = sampling::with_a_margin(aims, problem, &scale);
        }
        Self::of_scale(problem, settings, &aims, scale)
    }

    /// The same with an error to aim at for each part, in place of the accuracy.
    pub fn aimed(problem: &Problem, settings: &Settings, aims: &Aims) -> Result<Self, PlanError> {
        Self::of_scale(problem, settings, aims, Scale::of(problem))
    }

    fn of_scale(
        problem: &Problem,
        settings: &Settings,
        aims: &Aims,
        scale: Scale,
    ) -> Result<Self, PlanError> {
        limits::check_accuracy(aims.exchange_percent.min(aims.direct_percent))?;
        limits::check_overhang(problem)?;
        limits::check_height(&scale)?;
        limits::check_pattern(problem, &scale)?;
        let has_soil = problem.scene.soil_z_m.is_some();
        let lit = |b: usize| problem.sources.iter().any(|s| s.irradiance_W_m2[b] > 0.0);
        let scattering_bands: Vec<usize> = (0..problem.bands.len())
            .filter(|&b| lit(b) && !problem.bands[b].is_black(has_soil))
            .collect();
        let organ_m = scale.organ_m();
        let edge_m = elements::edge_m(&scale);
        let coarser = aims.coarser_elements();
        let elements = Elements::count(&problem.scene, edge_m * coarser);
        let sampling = (!scattering_bands.is_empty())
            .then(|| sampling::lines(problem, &scale, elements, settings, aims));
        // an open scene has no layers that go on for ever; its exchange is full
        let radius_m = match settings.diameter {
            Diameter::Metres(d) if problem.scene.pattern.is_some() => Some(0.5 * d),
            Diameter::Metres(_) | Diameter::Auto | Diameter::Infinite => None,
        };
        // a sphere longer than every line of sight is no bound
        let radius_m =
            radius_m.filter(|&r| sampling.is_some_and(|s| r < s.longest_sight_m(scale.height_m)));
        let finer = aims.exchange_percent / DEFAULT_ACCURACY_PERCENT;
        let of_direct = aims.direct_percent / DEFAULT_ACCURACY_PERCENT;
        let edge_m = edge_m.min(radius_m.map_or(f64::INFINITY, |r| r.max(organ_m / FINEST_CUT)));
        let max_edge_m = edge_m * coarser;
        let soil_cell_m = (0.2 * organ_m).clamp(
            (scale.ground_area_m2 / MOST_SOIL_CELLS).sqrt(),
            (scale.ground_area_m2 / LEAST_SOIL_CELLS)
                .sqrt()
                .max(f64::MIN_POSITIVE),
        );
        // points on the outline of an organ: see `spread_effort`
        let direct_line_area_m2 = (scale.organ_area_m2 / 10_000.0 * of_direct.powf(4.0 / 3.0))
            .min(scale.triangle_area_m2 / 4.0)
            .min(max_edge_m * max_edge_m / EDGE_SQUARED_IN_POINTS)
            .clamp(
                scale.ground_area_m2 / most_points(problem, of_direct),
                scale.ground_area_m2 / 1e4,
            )
            .max(f64::MIN_POSITIVE);
        let plan = Self {
            // what is not cut is as good as cut to its size
            aims: aims.with_elements_at_most(scale.triangle_edge_m / edge_m),
            scale,
            max_edge_m,
            soil_cell_m,
            radius_m,
            far_field: radius_m.map(|_| sampling::far_field(settings, finer)),
            sampling,
            direct_line_area_m2,
            seed: settings.seed,
            scattering_bands,
            tolerance: Tolerance {
                absorbed: (1e-4 * finer).clamp(1e-9, 1e-3),
                most_passes: 500,
            },
            memory: Memory::default(),
            reasons: Vec::new(),
        };
        let mut plan = plan.within(problem, settings.memory_GiB)?;
        plan.reasons = reasons::of(problem, settings, &plan);
        Ok(plan)
    }

    /// The plan as it is after its fields were changed, with the memory that it takes now, or why there is not
    /// enough of it. Its reasons are gone: they were those of the plan before the change.
    pub fn within(mut self, problem: &Problem, memory_GiB: f64) -> Result<Self, PlanError> {
        limits::check_elements(problem, self.max_edge_m)?;
        self.memory = Memory::of(problem, &self);
        self.reasons.clear();
        if self.memory.total_GiB() <= memory_GiB {
            return Ok(self);
        }
        Err(PlanError::Memory {
            needed: self.memory,
            limit_GiB: memory_GiB,
        })
    }

    /// The world that this plan works in.
    pub fn world(&self, problem: &Problem) -> World {
        World::new(
            &problem.scene,
            self.max_edge_m,
            self.soil_cell_m,
            self.radius_m.unwrap_or(f64::INFINITY),
            self.far_field.map_or((0, 0), |f| (f.levels, f.bins)),
        )
    }

    /// Planning the exchange for a larger error than this makes it no coarser.
    pub fn coarsest_exchange_percent(&self, problem: &Problem) -> f64 {
        sampling::coarsest_percent(problem, &self.scale)
    }

    /// Cross-sections of the lines of each source, m².
    pub fn direct_line_areas_m2(&self, problem: &Problem) -> Vec<f64> {
        direct::spread_effort(
            problem,
            &extent_of(&problem.scene),
            self.direct_line_area_m2,
            self.scale.ground_area_m2,
        )
    }
}

/// An organ of average size is not cut finer than into this many along a side, however small the sphere.
const FINEST_CUT: f64 = 24.0;

/// Soil cells, at most and at least.
const MOST_SOIL_CELLS: f64 = 1e6;
const LEAST_SOIL_CELLS: f64 = 64.0;

/// Lattice points of the strongest source, at most: some, and what a canopy of a tenth of a square metre
/// of leaf per square metre asks for. What is too small for them is probed with rays.
fn most_points(problem: &Problem, finer: f64) -> f64 {
    let scene = &problem.scene;
    let of_organs = 10_000.0 * scene.organs.len() as f64 / finer.powf(4.0 / 3.0);
    (1e6 + 10.0 * (of_organs + 4.0 * scene.triangles.len() as f64)).min(MOST_DIRECT_LINES)
}

/// Never more than this.
const MOST_DIRECT_LINES: f64 = 3e8;

/// An element of full size is met by half as many points as this, so that it is lit as it should be.
const EDGE_SQUARED_IN_POINTS: f64 = 32.0;
