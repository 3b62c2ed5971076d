//! The plan: what a scene needs, decided before anything is computed. What is not needed costs
//! nothing.

use nestrad_common::directions::Axes;
use nestrad_common::options::Diameter;
use nestrad_common::problem::Problem;
use serde::Serialize;

use crate::direct;
use crate::exchange::Sampling;
use crate::solver::Tolerance;
use crate::world::World;

/// What the user asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Diameter of the sphere of near exchange.
    pub diameter: Diameter,
    /// Standard error to aim at: rms over organs, in percent of the mean absorbed power per area.
    pub accuracy_percent: f64,
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
            accuracy_percent: 0.5,
            memory_GiB: 8.0,
            seed: 1,
            estimator: Estimator::default(),
        }
    }
}

/// What will be done, and why.
#[derive(Clone, Debug, Serialize)]
pub struct Plan {
    /// Radius of the sphere of near exchange, metres; `None` for plain radiosity.
    pub radius_m: Option<f64>,
    /// Sampling of the exchange; `None` when nothing scatters.
    pub sampling: Option<Sampling>,
    /// Cross-section of a line of the strongest source, m².
    pub direct_line_area_m2: f64,
    /// Numbers of the bands in which something scatters.
    pub scattering_bands: Vec<usize>,
    /// When the solver stops.
    pub tolerance: Tolerance,
    /// One line each: what, and the reason.
    pub reasons: Vec<String>,
}

impl Plan {
    /// Decides what a problem needs.
    pub fn new(problem: &Problem, settings: &Settings) -> Self {
        let has_soil = problem.scene.soil_z_m.is_some();
        let scattering_bands: Vec<usize> = (0..problem.bands.len())
            .filter(|&b| !problem.bands[b].is_black(has_soil))
            .collect();
        let radius_m = match settings.diameter {
            Diameter::Metres(d) => Some(0.5 * d),
            Diameter::Auto | Diameter::Infinite => None,
        };
        let sampling = Sampling {
            batches: 16,
            axes: Axes::Both,
            sets_per_batch: match settings.estimator {
                Estimator::Lines => 1,
                Estimator::Rays => 0,
            },
            line_area_m2: 0.006 * 0.006,
            least_samples: match settings.estimator {
                Estimator::Lines => 4.0,
                Estimator::Rays => 64.0,
            },
            seed: settings.seed,
        };
        Self {
            radius_m,
            sampling: (!scattering_bands.is_empty()).then_some(sampling),
            direct_line_area_m2: 0.0024 * 0.0024,
            scattering_bands,
            tolerance: Tolerance {
                absorbed: 1e-4,
                most_passes: 100,
            },
            reasons: Vec::new(),
        }
    }

    /// The world that this plan works in.
    pub fn world(&self, problem: &Problem) -> World {
        World::new(
            &problem.scene,
            0.05,
            0.05,
            self.radius_m.unwrap_or(f64::INFINITY),
            (0, 0),
        )
    }

    /// Cross-sections of the lines of each source, m².
    pub fn direct_line_areas_m2(&self, problem: &Problem) -> Vec<f64> {
        direct::spread_effort(problem, self.direct_line_area_m2)
    }
}
