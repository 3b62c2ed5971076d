//! The far ends: what stands for all that lies beyond the sphere of near exchange.
//!
//! A line of sight that meets nothing within the sphere passes out of it at a point; a [`FarGrid`] says which of
//! its ends stands for what comes from there. Lines, rays and solver ask here and nowhere else, so a grid is one
//! file in this folder.

mod levels;

use std::fmt;
use std::sync::Arc;

use glam::DVec2;

pub use levels::Levels;

/// How what lies beyond the sphere is divided into ends.
pub trait FarGrid: fmt::Debug + Send + Sync {
    /// Number of ends; they are numbered from 0.
    fn len(&self) -> u32;

    /// There is always an end.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The end that stands for what is seen past a point.
    fn end_at(&self, passage: &Passage<'_>) -> u32;

    /// Levels and polar bins per hemisphere of the layer model that the ends begin with.
    fn layers(&self) -> [u32; 2];

    /// Where an end stands in that layer model.
    fn in_layers(&self, end: u32) -> InLayers;

    /// The grid as levels and bins, if it is one: these can be sent to workers.
    fn as_levels(&self) -> Option<Levels> {
        None
    }
}

/// Where a line of sight passes out of the sphere.
pub struct Passage<'a> {
    /// Height of the point, from 0 at the bottom of the scene's extent to 1 at its top.
    pub height: f64,
    /// Where it lies, metres; with a pattern, in any copy of it.
    pub at_m: &'a dyn Fn() -> DVec2,
    /// z of the unit vector along which one looks: above 0 upwards.
    pub direction_z: f64,
    /// A number in [0, 1) to choose with between two ends around the point.
    pub random: f64,
}

/// A place in the layer model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InLayers {
    /// The light comes down, from above.
    pub from_above: bool,
    /// From 0 at the bottom.
    pub level: u32,
    /// From 0, nearest to the horizontal.
    pub bin: u32,
}

/// A way out of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// To the sky.
    Up = 0,
    /// Into the void, where there is no soil.
    Down = 1,
}

impl Exit {
    /// Both, in order.
    pub const BOTH: [Self; 2] = [Self::Up, Self::Down];

    /// The row in which the far field's lines have what leaves this way: behind those of the `far_ends`.
    pub fn row(self, far_ends: u32) -> u32 {
        far_ends + self as u32
    }
}

/// A grid that several hold.
pub type SharedFarGrid = Arc<dyn FarGrid>;
