//! Sensors: places whose light is wanted, where nothing stands. They receive and disturb nothing.

use std::f64::consts::PI;

use glam::DVec3;

/// Rays of a sensor where nothing else is asked for: see [`Sensor::rays`].
pub const DEFAULT_RAYS: u32 = 4096;

/// Rays of a sensor, at least and at most.
pub const RAYS: std::ops::RangeInclusive<u32> = 64..=1 << 20;

/// Bytes of a sensor's name, at most.
pub const MAX_SENSOR_NAME_BYTES: usize = 255;

/// Sensors of a scene, at most: cells of grids, sides and directions counted one by one.
pub const MOST_SENSORS: usize = 50_000;

/// A sensor: one place, looking one way.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensor {
    /// The user's name for it; cells of a grid, sides and directions share one.
    pub name: String,
    /// Where it is.
    pub shape: Shape,
    /// Where its light comes from.
    pub receives: Receives,
    /// Rays that look for what is scattered to it.
    pub rays: u32,
}

/// Where a sensor is, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A point.
    Point(DVec3),
    /// The mean over a triangle, from its first corner along two edges.
    Triangle(DVec3, [DVec3; 2]),
    /// The mean over a parallelogram, from a corner along two edges.
    Parallelogram(DVec3, [DVec3; 2]),
}

/// Where the light of a sensor comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Receives {
    /// From the half space that it faces: irradiance of a plane.
    Side {
        /// A unit vector.
        facing: DVec3,
        /// Whether this is what is called the lower side.
        lower: bool,
    },
    /// From everywhere alike: scalar irradiance, which is four times the mean irradiance of a small sphere.
    Everywhere,
    /// From a direction (a unit vector from the sensor to what it looks at): radiance.
    From(DVec3),
}

impl Sensor {
    /// Its centre, metres.
    pub fn centre_m(&self) -> DVec3 {
        match self.shape {
            Shape::Point(at) => at,
            Shape::Triangle(at, [a, b]) => at + (a + b) / 3.0,
            Shape::Parallelogram(at, [a, b]) => at + 0.5 * (a + b),
        }
    }

    /// What it receives, in a word.
    pub fn side(&self) -> &'static str {
        match self.receives {
            Receives::Side { lower: false, .. } => "upper",
            Receives::Side { lower: true, .. } => "lower",
            Receives::Everywhere => "sphere",
            Receives::From(_) => "radiance",
        }
    }

    /// What it measures where all that it sees has a radiosity of 1.
    pub fn of_unit_radiosity(&self) -> f64 {
        match self.receives {
            Receives::Side { .. } => 1.0,
            Receives::Everywhere => 4.0,
            Receives::From(_) => 1.0 / PI,
        }
    }
}

impl Shape {
    /// The same elsewhere.
    #[must_use]
    pub fn moved(self, by: DVec3) -> Self {
        match self {
            Self::Point(at) => Self::Point(at + by),
            Self::Triangle(at, edges) => Self::Triangle(at + by, edges),
            Self::Parallelogram(at, edges) => Self::Parallelogram(at + by, edges),
        }
    }

    /// Its corners.
    pub fn corners_m(&self) -> Vec<DVec3> {
        match *self {
            Self::Point(at) => vec![at],
            Self::Triangle(at, [a, b]) => vec![at, at + a, at + b],
            Self::Parallelogram(at, [a, b]) => vec![at, at + a, at + a + b, at + b],
        }
    }

    /// The point at a place in the unit square, which is uniform over the shape where that is over the square.
    pub fn point_m(&self, [u, v]: [f64; 2]) -> DVec3 {
        match *self {
            Self::Point(at) => at,
            Self::Triangle(at, [a, b]) => {
                // the other half of the square is folded back
                let (u, v) = if u + v > 1.0 {
                    (1.0 - u, 1.0 - v)
                } else {
                    (u, v)
                };
                at + u * a + v * b
            }
            Self::Parallelogram(at, [a, b]) => at + u * a + v * b,
        }
    }
}
