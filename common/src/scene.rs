//! The scene: triangles with their organ and material, the pattern, the soil.

use std::fmt;

use glam::{DVec2, DVec3};

/// A canopy ready to be computed: checked, in metres, moved to a local origin.
///
/// Conventions: z up; the *upper* face of a triangle is the one that the right-hand normal
/// `(v1 - v0) x (v2 - v0)` points to. Triangle, organ and material order is the user's.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    /// Vertices in metres, relative to `origin_m`.
    pub triangles: Vec<[DVec3; 3]>,
    /// Index into `organs`, per triangle.
    pub organ: Vec<u32>,
    /// Index into `materials`, per triangle.
    pub material: Vec<u32>,
    /// In order of first appearance.
    pub organs: Vec<Organ>,
    /// In order of first appearance; optics are looked up by this name.
    pub materials: Vec<Material>,
    /// What was subtracted from the user's coordinates (already in metres).
    pub origin_m: DVec3,
    /// The rectangle on which the canopy repeats for ever; `None` for an isolated scene.
    pub pattern: Option<Pattern>,
    /// Height of the soil plane, relative to `origin_m`; `None` for a black void below.
    pub soil_z_m: Option<f64>,
}

/// A group of triangles that is reported as one.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Organ {
    /// As in the output: for CAN, plant * 1000 + leaf; for OBJ, the group's name.
    pub id: String,
    /// The plant it belongs to: for CAN, the plant number; for OBJ, the object's name.
    pub plant: String,
}

/// What a triangle is made of; a band gives it optical properties.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Material {
    /// Opaque part of a CAN species (leaf number 0).
    Stem {
        /// Species number of the CAN label, 1 or more.
        species: u32,
    },
    /// Leaf of a CAN species.
    Leaf {
        /// Species number of the CAN label, 1 or more.
        species: u32,
    },
    /// Soil triangle (CAN species 0): opaque, with the soil's albedo.
    Soil,
    /// A material known by name (OBJ).
    Named(String),
}

impl fmt::Display for Material {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stem { species } => write!(f, "stem of species {species}"),
            Self::Leaf { species } => write!(f, "leaf of species {species}"),
            Self::Soil => f.write_str("soil"),
            Self::Named(name) => f.write_str(name),
        }
    }
}

/// The rectangle in x, y on which a periodic canopy repeats, relative to the local origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pattern {
    /// Lower corner, metres.
    pub min_m: DVec2,
    /// Extent in x and y, metres, both positive.
    pub size_m: DVec2,
}

impl Pattern {
    /// Area of the rectangle, m².
    pub fn area_m2(&self) -> f64 {
        self.size_m.x * self.size_m.y
    }
}
