//! A homogeneous canopy: flat leaves anywhere in a layer, as radiative transfer theory has them.

use std::f64::consts::TAU;

use glam::{DMat3, DVec2, DVec3};

use super::angles::LeafAngles;
use super::canopy::{Generated, Label};
use super::dice::Dice;
use super::{GenerateError, check};
use crate::canopy::Pattern;

/// The outline of a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LeafShape {
    /// A regular octagon, 6 triangles.
    Disc,
    /// 2 triangles.
    Square,
}

/// Equal flat leaves whose places are independent and uniform in a horizontal layer above the soil.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomCanopy {
    /// One-sided leaf area per ground area, `> 0`. It is met exactly: leaf size gives way.
    pub leaf_area_index: f64,
    /// Inclinations; they are drawn by strata, so that few leaves suffice to represent it.
    pub angles: LeafAngles,
    /// Outline of the leaves.
    pub shape: LeafShape,
    /// Area of a leaf, 1e-6 m² or more; it is adjusted so that a whole number of them gives the
    /// leaf area index.
    pub leaf_m2: f64,
    /// The rectangle that repeats, along x and y, metres. Leaves that reach past its edge are left
    /// whole: the canopy goes on with their like on the other side.
    pub size_m: DVec2,
    /// Height of the layer, metres: at least the length of a leaf.
    pub height_m: f64,
    /// Another seed, other leaves.
    pub seed: u64,
}

impl Default for RandomCanopy {
    /// Spherical leaf angles, a leaf area index of 3, square leaves of 4 cm² in 1 m x 1 m x 1 m.
    fn default() -> Self {
        Self {
            leaf_area_index: 3.0,
            angles: LeafAngles::Spherical,
            shape: LeafShape::Square,
            leaf_m2: 4e-4,
            size_m: DVec2::ONE,
            height_m: 1.0,
            seed: 1,
        }
    }
}

impl RandomCanopy {
    /// Makes the canopy. Labels: leaves are numbered up to 999 a plant and then go on with the next
    /// plant; elements are 1.
    pub fn generate(&self) -> Result<Generated, GenerateError> {
        let count = self.leaf_count()?;
        let size_m = self.size_m;
        let mut canopy = Generated::empty(Pattern {
            min_m: -0.5 * size_m,
            size_m,
        });
        let leaf_m2 = self.leaf_area_index * canopy.pattern.area_m2() / f64::from(count);
        let outline = self.shape.outline(leaf_m2);
        let reach_m = outline[0].length();
        check(
            self.height_m.is_finite() && self.height_m >= 2.0 * reach_m,
            "height in m",
            self.height_m,
            "a finite height, at least the length of a leaf",
        )?;
        let dice = &mut Dice::new(self.seed, 0);
        // one stratum of the angles a leaf, in an order that has nothing to do with place or number
        for (leaf, stratum) in (0..count).zip(dice.order(count)) {
            let quantile = (f64::from(stratum) + dice.unit()) / f64::from(count);
            let inclination = self.angles.inclination(quantile);
            let turn = DMat3::from_rotation_z(dice.azimuth())
                * DMat3::from_rotation_y(inclination)
                * DMat3::from_rotation_z(dice.azimuth());
            let keep_off = reach_m * inclination.sin();
            let centre = DVec3::new(
                size_m.x * (dice.unit() - 0.5),
                size_m.y * (dice.unit() - 0.5),
                keep_off + (self.height_m - 2.0 * keep_off) * dice.unit(),
            );
            let label = Label {
                species: 1,
                plant: 1 + leaf / Label::MAX_LEAF,
                leaf: 1 + leaf % Label::MAX_LEAF,
                element: 1,
            };
            let corner = |i: usize| centre + turn * outline[i];
            for i in 1..outline.len() - 1 {
                canopy.push(label, [corner(0), corner(i), corner(i + 1)]);
            }
        }
        Ok(canopy)
    }

    fn leaf_count(&self) -> Result<u32, GenerateError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        for (name, value) in [
            ("leaf area index", self.leaf_area_index),
            ("pattern size along x in m", self.size_m.x),
            ("pattern size along y in m", self.size_m.y),
        ] {
            check(positive(value), name, value, "a positive number")?;
        }
        check(
            self.leaf_m2.is_finite() && self.leaf_m2 >= 1e-6,
            "leaf area in m2",
            self.leaf_m2,
            "a finite area of 1e-6 or more",
        )?;
        if let LeafAngles::Ellipsoidal { chi } = self.angles {
            check(
                positive(chi),
                "chi of the leaf angles",
                chi,
                "a positive number",
            )?;
        }
        let ground_m2 = self.size_m.x * self.size_m.y;
        let count = (self.leaf_area_index * ground_m2 / self.leaf_m2)
            .round()
            .max(1.0);
        let most = f64::from(Label::MAX_PLANT * Label::MAX_LEAF);
        check(count <= most, "number of leaves", count, "at most 99898001")?;
        Ok(count as u32)
    }
}

impl LeafShape {
    /// Corners of a horizontal leaf of an area, counter-clockwise about the origin.
    fn outline(self, area_m2: f64) -> Vec<DVec3> {
        let corners = match self {
            Self::Disc => 8,
            Self::Square => 4,
        };
        let step = TAU / f64::from(corners);
        let radius_m = (2.0 * area_m2 / (f64::from(corners) * step.sin())).sqrt();
        (0..corners)
            .map(|i| radius_m * DVec2::from_angle(step * f64::from(i)).extend(0.0))
            .collect()
    }
}
