//! What a generator gives: labelled triangles on a pattern.

use std::fmt;

use glam::DVec3;

use crate::canopy::Pattern;

/// Soil plane of all generated canopies, metres: a little below the lowest vertex, so that nothing
/// lies in the plane itself.
pub(super) const SOIL_Z_M: f64 = -0.002;

/// Vertices are rounded to a millionth of a metre: short in a file, and exact when read back.
const VERTICES_PER_M: f64 = 1e6;

/// A label of the CAN format; it is written as one number, species first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Label {
    /// Optical species, 1 to 9.
    pub species: u32,
    /// 1 to [`Label::MAX_PLANT`].
    pub plant: u32,
    /// 1 to [`Label::MAX_LEAF`], or 0 for the opaque parts of a plant.
    pub leaf: u32,
    /// Part of the leaf, 1 to 999; what it means is up to the generator.
    pub element: u32,
}

impl Label {
    /// Highest plant number that five digits hold.
    pub const MAX_PLANT: u32 = 99_999;
    /// Highest leaf number that three digits hold.
    pub const MAX_LEAF: u32 = 999;
}

impl fmt::Display for Label {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            species,
            plant,
            leaf,
            element,
        } = self;
        write!(f, "{species}{plant:05}{leaf:03}{element:03}")
    }
}

/// A generated canopy, in metres, z up, on a rectangle that repeats for ever. Leaves may reach past
/// the rectangle's edge.
#[derive(Clone, Debug, PartialEq)]
pub struct Generated {
    /// Never degenerate; the upper face of a leaf (right-hand normal) is its adaxial side, and that
    /// of a stem is its outside.
    pub triangles: Vec<[DVec3; 3]>,
    /// One per triangle.
    pub labels: Vec<Label>,
    /// The rectangle in x, y.
    pub pattern: Pattern,
    /// Height of the soil plane.
    pub soil_z_m: f64,
}

impl Generated {
    pub(super) fn empty(pattern: Pattern) -> Self {
        Self {
            triangles: Vec::new(),
            labels: Vec::new(),
            pattern,
            soil_z_m: SOIL_Z_M,
        }
    }

    /// Adds a triangle, or nothing if its vertices fall together once they are rounded (the rows of
    /// a blade do so at its tip).
    pub(super) fn push(&mut self, label: Label, triangle: [DVec3; 3]) {
        // adding zero turns -0 into 0, which is shorter
        let rounded = triangle.map(|v| (v * VERTICES_PER_M).round() / VERTICES_PER_M + DVec3::ZERO);
        if area_m2(&rounded) > 0.0 {
            self.triangles.push(rounded);
            self.labels.push(label);
        }
    }

    /// One-sided area of everything that is not opaque, over the area of the pattern.
    pub fn leaf_area_index(&self) -> f64 {
        let leaves = self.triangles.iter().zip(&self.labels);
        let area: f64 = leaves
            .filter(|(_, label)| label.leaf > 0)
            .map(|(triangle, _)| area_m2(triangle))
            .sum();
        area / self.pattern.area_m2()
    }
}

fn area_m2([a, b, c]: &[DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
