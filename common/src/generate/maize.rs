//! Maize at flowering: a straight stem and two opposite ranks of long, bending leaves.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::blade::{Station, push_blade, strips};
use super::canopy::{Generated, Label};
use super::dice::Dice;
use super::stand::Stand;
use super::tube::{Joint, push_tube};
use super::{GenerateError, check_leaf_triangle};

/// A field of maize, about 2.2 m high. With the default spacing its leaf area index is about 4.
#[derive(Clone, Debug, PartialEq)]
pub struct Maize {
    /// Where the plants stand.
    pub stand: Stand,
    /// Area that the triangles of the leaves have on average, 1e-7 to 1e-2 m².
    pub leaf_triangle_m2: f64,
    /// Another seed, other plants.
    pub seed: u64,
}

impl Default for Maize {
    /// 2 rows of 4 plants, 0.75 m x 0.20 m, about 8000 triangles a plant.
    fn default() -> Self {
        Self {
            stand: Stand {
                rows: 2,
                plants_per_row: 4,
                row_spacing_m: 0.75,
                plant_spacing_m: 0.20,
            },
            leaf_triangle_m2: 0.8e-4,
            seed: 1,
        }
    }
}

/// Length and greatest width of the largest leaf of an average plant, metres.
const LEAF_LENGTH_M: f64 = 0.86;
const LEAF_WIDTH_M: f64 = 0.086;
/// Mean of [`relative_width`] along the leaf.
const MEAN_RELATIVE_WIDTH: f64 = 0.744;
/// Heights of the lowest and the highest node of an average plant, metres.
const LOWEST_NODE_M: f64 = 0.16;
const HIGHEST_NODE_M: f64 = 1.75;
/// The stem goes on above the highest node, as the stalk of the tassel, metres.
const STALK_M: f64 = 0.4;
const STEM_SIDES: u32 = 8;

impl Maize {
    /// Makes the field. Labels: leaf 0 is the stem, leaves count from the lowest, elements are 1.
    pub fn generate(&self) -> Result<Generated, GenerateError> {
        self.stand.check()?;
        check_leaf_triangle(self.leaf_triangle_m2)?;
        let mut canopy = Generated::empty(self.stand.pattern());
        for (number, foot) in self.stand.plants() {
            self.push_plant(&mut canopy, number, foot);
        }
        Ok(canopy)
    }

    fn push_plant(&self, canopy: &mut Generated, number: u32, foot: DVec2) {
        let dice = &mut Dice::new(self.seed, number);
        let label = |leaf| Label {
            species: 1,
            plant: number,
            leaf,
            element: 1,
        };
        let vigour = dice.around(1.0, 0.08);
        let leaves = dice.whole(12, 17);
        let stem = Stem::new(foot, vigour, leaves, dice);
        push_tube(canopy, label(0), &stem.joints, STEM_SIDES);
        let rank_azimuth = dice.azimuth();
        for leaf in 1..=leaves {
            let opposite = PI * f64::from(leaf % 2);
            let azimuth = rank_azimuth + opposite + dice.around(0.0, 0.35);
            let height = f64::from(leaf - 1) / f64::from(leaves - 1);
            let blade = Blade::new(stem.node(leaf), azimuth, height, vigour, dice);
            let (along, across) = strips(
                blade.length_m,
                MEAN_RELATIVE_WIDTH * blade.width_m,
                self.leaf_triangle_m2,
            );
            push_blade(canopy, label(leaf), &blade.stations(along), across);
        }
    }
}

/// A stem with two joints for every node.
struct Stem {
    joints: Vec<Joint>,
}

impl Stem {
    fn new(foot: DVec2, vigour: f64, leaves: u32, dice: &mut Dice) -> Self {
        let lean = DVec2::from_angle(dice.azimuth()) * dice.around(0.01, 0.01);
        let (lowest, highest) = (LOWEST_NODE_M * vigour, HIGHEST_NODE_M * vigour);
        let tip = highest + STALK_M * vigour;
        let joint = |z: f64| Joint {
            point: (foot + lean * z * z).extend(z),
            radius_m: 0.012 * vigour * (1.0 - 0.85 * (z / tip).powi(2)),
        };
        let mut joints = vec![joint(0.0), joint(0.5 * lowest)];
        let internode = (highest - lowest) / f64::from(leaves - 1);
        for node in 0..leaves {
            let z = lowest + internode * f64::from(node);
            joints.extend([joint(z), joint(z + 0.5 * internode)]);
        }
        joints.extend([joint(0.5 * (highest + tip)), joint(tip)]);
        Self { joints }
    }

    /// The node of a leaf, counted from 1.
    fn node(&self, leaf: u32) -> Joint {
        self.joints[2 * leaf as usize]
    }
}

/// A leaf: its midrib bends over from an upright base, `inclination` being its angle from the
/// vertical.
struct Blade {
    node: Joint,
    azimuth: f64,
    length_m: f64,
    width_m: f64,
    inclination_base: f64,
    inclination_tip: f64,
    /// The midrib turns sideways and the blade rolls, both by these angles from base to tip.
    drift: f64,
    roll: f64,
    waves: f64,
    wave_phase: [f64; 2],
}

impl Blade {
    /// A leaf at a relative height on the stem, 0 for the lowest and 1 for the highest.
    fn new(node: Joint, azimuth: f64, height: f64, vigour: f64, dice: &mut Dice) -> Self {
        // the largest leaves stand a little above the middle
        let size = vigour * (1.0 - 2.0 * (height - 0.55).powi(2));
        let degrees =
            |mean: f64, spread: f64, dice: &mut Dice| dice.around(mean, spread).to_radians();
        Self {
            node,
            azimuth,
            length_m: LEAF_LENGTH_M * size * dice.around(1.0, 0.06),
            width_m: LEAF_WIDTH_M * (0.4 * vigour + 0.6 * size) * dice.around(1.0, 0.06),
            inclination_base: degrees(26.0 - 12.0 * height, 5.0, dice),
            // low leaves are too short to hang, the youngest are still upright
            inclination_tip: degrees(
                100.0 + 150.0 * height * (1.0 - height) - 25.0 * height,
                18.0,
                dice,
            ),
            drift: degrees(0.0, 20.0, dice),
            roll: degrees(0.0, 25.0, dice),
            waves: dice.around(5.0, 1.5),
            wave_phase: [dice.azimuth(), dice.azimuth()],
        }
    }

    fn stations(&self, along: u32) -> Vec<Station> {
        let step = 1.0 / f64::from(along);
        let outwards = DVec2::from_angle(self.azimuth).extend(0.0);
        let mut point = self.node.point + self.node.radius_m * outwards;
        let mut stations = vec![self.station(0.0, point)];
        for i in 0..along {
            let s = f64::from(i) * step;
            point += self.axes(s + 0.5 * step).0 * self.length_m * step;
            stations.push(self.station(s + step, point));
        }
        stations
    }

    fn station(&self, s: f64, point: DVec3) -> Station {
        let (along, level) = self.axes(s);
        let (sin, cos) = (self.roll * s).sin_cos();
        // the base clasps the stem; the edge is longer than the midrib, and so undulates
        let fold = (8.0 + 45.0 * (1.0 - s).powi(4)).to_radians();
        let amplitude_m = 0.12 * self.width_m * (PI * s).sin();
        Station {
            point,
            along,
            across: cos * level + sin * along.cross(level),
            half_width_m: 0.5 * self.width_m * relative_width(s),
            fold,
            edge_m: self
                .wave_phase
                .map(|phase| amplitude_m * (2.0 * PI * self.waves * s + phase).sin()),
        }
    }

    /// Direction of the midrib at `s`, and the horizontal to its left.
    fn axes(&self, s: f64) -> (DVec3, DVec3) {
        let bend = self.inclination_tip - self.inclination_base;
        let (sin_inc, cos_inc) = (self.inclination_base + bend * s.powf(1.4)).sin_cos();
        let (sin_az, cos_az) = (self.azimuth + self.drift * s * s).sin_cos();
        (
            DVec3::new(sin_inc * cos_az, sin_inc * sin_az, cos_inc),
            DVec3::new(-sin_az, cos_az, 0.0),
        )
    }
}

/// Width of a leaf at `s` of its length, over its greatest width: the parabola that starts at 0.6,
/// has its maximum of 1 at s = 0.39 and ends at 0.
fn relative_width(s: f64) -> f64 {
    (0.6 + 2.065 * s - 2.665 * s * s).max(0.0)
}
