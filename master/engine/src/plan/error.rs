//! Why no plan can be made.

use std::fmt;

use thiserror::Error;

use super::Memory;

/// Why no plan can be made.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PlanError {
    /// It does not fit.
    #[error(
        "the solve needs about {:.2} GiB (program {:.2}, scene {:.2}, rows {:.2}, solver {:.2}), the limit is {} GiB: allow more with --memory",
        .needed.total_GiB(), .needed.program_GiB, .needed.scene_GiB, .needed.rows_GiB, .needed.solver_GiB,
        Short(*.limit_GiB)
    )]
    Memory {
        /// What the smallest plan for this accuracy takes.
        needed: Memory,
        /// What the user allows.
        limit_GiB: f64,
    },
    /// There is not time enough for any.
    #[error(
        "the coarsest solve of this scene takes about {needed_s:.1} s on this machine, the limit is {} s: allow more with --budget", Short(*.limit_s)
    )]
    Time {
        /// What the coarsest plan should take.
        needed_s: f64,
        /// What is left of what the user allows.
        limit_s: f64,
    },
    /// There was not time enough for the coarsest.
    #[error(
        "--budget is over: the first, coarsest round was not done after {needed_s:.1} s; the limit is {} s: allow more with --budget", Short(*.limit_s)
    )]
    Overtime {
        /// How long it was worked at.
        needed_s: f64,
        /// What the user allows.
        limit_s: f64,
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
        "triangle {triangle} (counted from 0) extends over {patterns:.1e} copies of the pattern, expected at most {most:.0e}: is the unit right?"
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
        "the scene, soil included, is {height_m:.3e} m high, so heights are exact to {step_m:.1e} m only, but a triangle is {triangle_m:.1e} m wide: is the height of the soil right?"
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
        "triangles would be cut into {found} elements, expected at most {most}: choose a larger --diameter, or allow a larger error with --accuracy"
    )]
    Elements {
        /// How many there would be.
        found: u64,
        /// How many can be numbered.
        most: u64,
    },
}

impl PlanError {
    /// Whether a coarser plan may do.
    pub fn is_of_size(&self) -> bool {
        matches!(self, Self::Memory { .. } | Self::Elements { .. })
    }
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
