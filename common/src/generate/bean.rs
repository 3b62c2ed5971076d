//! Bean at full canopy: branched stems, long petioles, leaves of three ovate leaflets.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use super::angles::LeafAngles;
use super::blade::{Station, push_blade, strips};
use super::canopy::{Generated, Label};
use super::dice::Dice;
use super::stand::Stand;
use super::tube::{Joint, push_tube};
use super::{GenerateError, check_leaf_triangle};

/// A field of bean, about 0.6 m high. With the default spacing its leaf area index is about 4.
#[derive(Clone, Debug, PartialEq)]
pub struct Bean {
    /// Where the plants stand.
    pub stand: Stand,
    /// Area that the triangles of the leaflets have on average, 1e-7 to 1e-2 m².
    pub leaf_triangle_m2: f64,
    /// Another seed, other plants.
    pub seed: u64,
}

impl Default for Bean {
    /// 2 rows of 4 plants, 0.5 m x 0.1 m.
    fn default() -> Self {
        Self {
            stand: Stand {
                rows: 2,
                plants_per_row: 4,
                row_spacing_m: 0.5,
                plant_spacing_m: 0.1,
            },
            leaf_triangle_m2: 0.5e-4,
            seed: 1,
        }
    }
}

const NODES: u32 = 9;
const LOWEST_NODE_M: f64 = 0.08;
const INTERNODE_M: f64 = 0.045;
/// Of the largest terminal leaflet of an average plant, metres; and width over length.
const LEAFLET_LENGTH_M: f64 = 0.105;
const LEAFLET_SLENDERNESS: f64 = 0.68;
/// Mean of [`relative_width`] along the leaflet.
const MEAN_RELATIVE_WIDTH: f64 = 0.72;
/// Leaflets hang at most this steeply, radians.
const STEEPEST: f64 = 1.2;
const PETIOLE_SIDES: u32 = 5;

impl Bean {
    /// Makes the field. Labels: leaf 0 is stems and petioles, leaves are numbered as they come, the
    /// main stem's first; elements 1 to 3 are leaflets: terminal, left, right.
    pub fn generate(&self) -> Result<Generated, GenerateError> {
        self.stand.check()?;
        check_leaf_triangle(self.leaf_triangle_m2)?;
        let mut canopy = Generated::empty(self.stand.pattern());
        for (number, foot) in self.stand.plants() {
            let dice = Dice::new(self.seed, number);
            let mut plant = Plant {
                canopy: &mut canopy,
                dice,
                number,
                leaves: 0,
                leaf_triangle_m2: self.leaf_triangle_m2,
            };
            plant.grow(foot);
        }
        Ok(canopy)
    }
}

/// A plant while it is being put together.
struct Plant<'a> {
    canopy: &'a mut Generated,
    dice: Dice,
    number: u32,
    leaves: u32,
    leaf_triangle_m2: f64,
}

/// A stem or a branch: where it starts, where to, and how much of it there is.
struct Axis {
    foot: DVec3,
    azimuth: f64,
    /// From the vertical, radians, at the foot; it straightens up towards the tip.
    inclination: f64,
    nodes: u32,
    radius_m: f64,
    vigour: f64,
}

impl Plant<'_> {
    fn grow(&mut self, foot: DVec2) {
        let vigour = self.dice.around(1.0, 0.1);
        let main = Axis {
            foot: foot.extend(0.0),
            azimuth: self.dice.azimuth(),
            inclination: self.dice.around(0.1, 0.1),
            nodes: NODES,
            radius_m: 0.0035 * vigour,
            vigour,
        };
        let nodes = self.push_axis(&main, LOWEST_NODE_M);
        let branches = self.dice.whole(2, 3);
        for branch in 0..branches {
            let side = PI * f64::from(branch % 2);
            let axis = Axis {
                foot: nodes[branch as usize],
                azimuth: main.azimuth + FRAC_PI_2 + side + self.dice.around(0.0, 0.6),
                inclination: self.dice.around(0.75, 0.15),
                nodes: self.dice.whole(4, 5),
                radius_m: 0.0022 * vigour,
                vigour: 0.9 * vigour,
            };
            self.push_axis(&axis, 1.3 * INTERNODE_M);
        }
    }

    /// Adds a stem with a leaf at every node, and returns the nodes.
    fn push_axis(&mut self, axis: &Axis, first_internode_m: f64) -> Vec<DVec3> {
        let mut point = axis.foot;
        let joint = |point, i: u32| Joint {
            point,
            radius_m: axis.radius_m * (1.0 - 0.7 * f64::from(i) / f64::from(axis.nodes)),
        };
        let mut joints = vec![joint(point, 0)];
        let mut nodes = Vec::new();
        let heading = DVec2::from_angle(axis.azimuth);
        for i in 1..=axis.nodes {
            let inclination = axis.inclination * 0.8_f64.powf(f64::from(i - 1));
            let zigzag = self.dice.around(0.0, 0.12);
            let along = (heading * inclination.sin() + heading.perp() * zigzag)
                .extend(inclination.cos())
                .normalize();
            let length_m = if i == 1 {
                first_internode_m
            } else {
                INTERNODE_M
            };
            point += axis.vigour * length_m * along;
            joints.push(joint(point, i));
            nodes.push(point);
        }
        push_tube(self.canopy, self.label(0, 1), &joints, 6);
        for (i, node) in (1_u32..).zip(&nodes) {
            let side = PI * f64::from(i % 2);
            let azimuth = axis.azimuth + side + self.dice.around(0.0, 0.9);
            // leaves grow up to the middle of a stem and are still unfolding at its tip
            let rank = f64::from(i) / f64::from(axis.nodes);
            let size = axis.vigour * (1.0 - 1.3 * (rank - 0.55).powi(2));
            self.push_leaf(*node, azimuth, size);
        }
        nodes
    }

    fn push_leaf(&mut self, node: DVec3, azimuth: f64, size: f64) {
        self.leaves += 1;
        let heading = DVec2::from_angle(azimuth);
        let elevation = self.dice.around(0.85, 0.3);
        let petiole_m = size * self.dice.around(0.15, 0.03);
        let rise = |elevation: f64| (heading * elevation.cos()).extend(elevation.sin());
        let bend = node + 0.5 * petiole_m * rise(elevation + 0.12);
        let tip = bend + 0.5 * petiole_m * rise(elevation - 0.12);
        let radius_m = 0.0015 * size;
        let thick = |point| Joint { point, radius_m };
        push_tube(
            self.canopy,
            self.label(0, 1),
            &[thick(node), thick(bend), thick(tip)],
            PETIOLE_SIDES,
        );
        // the terminal leaflet stands off on the end of the leaf's axis
        let knee = tip + 0.03 * size * heading.extend(0.3).normalize();
        let end = Joint {
            point: knee,
            radius_m: 0.7 * radius_m,
        };
        push_tube(
            self.canopy,
            self.label(0, 1),
            &[thick(tip), end],
            PETIOLE_SIDES,
        );
        let gap = 0.004 * size;
        for (element, base, turn, relative_size) in [
            (1, knee, 0.0, 1.0),
            (2, tip, 1.45, 0.88),
            (3, tip, -1.45, 0.88),
        ] {
            let leaflet_azimuth = azimuth + turn + self.dice.around(0.0, 0.2);
            let stand_off = gap * DVec2::from_angle(leaflet_azimuth).extend(0.0);
            let leaflet = Leaflet::new(
                base + stand_off,
                leaflet_azimuth,
                size * relative_size,
                &mut self.dice,
            );
            let width_m = MEAN_RELATIVE_WIDTH * leaflet.width_m;
            let (along, across) = strips(leaflet.length_m, width_m, self.leaf_triangle_m2);
            push_blade(
                self.canopy,
                self.label(self.leaves, element),
                &leaflet.stations(along),
                across,
            );
        }
    }

    fn label(&self, leaf: u32, element: u32) -> Label {
        Label {
            species: 1,
            plant: self.number,
            leaf,
            element,
        }
    }
}

/// A leaflet that slopes down from its base, its midrib bending over a little.
struct Leaflet {
    base: DVec3,
    azimuth: f64,
    length_m: f64,
    width_m: f64,
    /// Of the midrib at its middle, below the horizontal, radians.
    slope: f64,
    droop: f64,
    roll: f64,
    fold: f64,
}

impl Leaflet {
    fn new(base: DVec3, azimuth: f64, size: f64, dice: &mut Dice) -> Self {
        let length_m = LEAFLET_LENGTH_M * size * dice.around(1.0, 0.08);
        Self {
            base,
            azimuth,
            length_m,
            width_m: LEAFLET_SLENDERNESS * length_m * dice.around(1.0, 0.08),
            slope: LeafAngles::Planophile
                .inclination(dice.unit())
                .min(STEEPEST),
            droop: dice.around(0.35, 0.2),
            roll: dice.around(0.0, 0.45),
            fold: dice.around(0.2, 0.12),
        }
    }

    fn stations(&self, along: u32) -> Vec<Station> {
        let step = 1.0 / f64::from(along);
        let mut point = self.base;
        let mut stations = vec![self.station(0.0, point)];
        for i in 0..along {
            let s = f64::from(i) * step;
            point += self.along(s + 0.5 * step) * self.length_m * step;
            stations.push(self.station(s + step, point));
        }
        stations
    }

    fn station(&self, s: f64, point: DVec3) -> Station {
        let along = self.along(s);
        let level = DVec2::from_angle(self.azimuth).perp().extend(0.0);
        let (sin, cos) = self.roll.sin_cos();
        let ripple = 0.03 * self.width_m * (2.0 * PI * s).sin();
        Station {
            point,
            along,
            across: cos * level + sin * along.cross(level),
            half_width_m: 0.5 * self.width_m * relative_width(s),
            fold: self.fold,
            edge_m: [ripple, -ripple],
        }
    }

    /// Direction of the midrib at `s`.
    fn along(&self, s: f64) -> DVec3 {
        let slope = self.slope + self.droop * (s - 0.5);
        (DVec2::from_angle(self.azimuth) * slope.cos()).extend(-slope.sin())
    }
}

/// Width of a leaflet at `s` of its length, over its greatest width: broad and round below the
/// middle, pointed at the tip, nothing at both ends.
fn relative_width(s: f64) -> f64 {
    let outline = |s: f64| s.max(0.0).powf(0.55) * (1.0 - s).max(0.0).powf(0.85);
    outline(s) / outline(0.55 / 1.4)
}
