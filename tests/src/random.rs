//! Small scenes drawn at random, tame ones for properties and wild ones to look for faults. A scene is
//! its seed: what failed once is tested by its number.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use nestrad_common::assemble::{Geometry, build_canopy};
use nestrad_common::canopy::Canopy;
use nestrad_common::formats::can;
use nestrad_common::formats::pattern::Rectangle;
use nestrad_common::light::{Light, Source};
use nestrad_common::optics::{Band, FaceOptics, LeafOptics, Optics};
use nestrad_common::options::{Unit, Up};
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Plan;

use crate::scenery::{Scenery, from_zenith};

/// Random numbers (SplitMix64; Steele, Lea & Flood 2014).
pub struct Dice(pub u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In `0..n`.
    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn point(&mut self) -> DVec3 {
        DVec3::new(self.unit(), self.unit(), self.unit())
    }

    fn face(&mut self) -> FaceOptics {
        let (all, part) = (0.95 * self.unit(), self.unit());
        FaceOptics {
            rho: all * part,
            tau: all * (1.0 - part),
        }
    }

    /// Both faces, up to 0.95 scattered.
    pub fn leaf(&mut self) -> LeafOptics {
        LeafOptics {
            upper: self.face(),
            lower: self.face(),
        }
    }
}

/// One to six triangles of two materials, `leaf` and `other`, alone or repeated, over soil or not, under
/// two sources in one band; every triangle is an organ.
pub fn scenery(seed: u64) -> Scenery {
    let mut dice = Dice(seed);
    let mut scenery = match dice.below(3) {
        0 => Scenery::open(),
        1 => Scenery::periodic(DVec2::new(0.7, 0.9)),
        _ => Scenery::periodic(DVec2::new(0.7, 0.9)).soil(-0.05),
    };
    for k in 0..1 + dice.below(6) {
        let material = ["leaf", "other"][dice.below(2)];
        let corners = [dice.point(), dice.point(), dice.point()];
        scenery.triangle(&format!("{material} {k}"), corners);
    }
    let (leaf, other, soil) = (dice.leaf(), dice.leaf(), dice.unit());
    scenery.band("B", soil, &[("leaf", leaf), ("other", other)]);
    for _ in 0..2 {
        let direction = from_zenith(80.0 * dice.unit(), 360.0 * dice.unit());
        scenery.source(direction, 10.0 + 90.0 * dice.unit());
    }
    scenery
}

/// Makes a plan for a small scene as cheap as can be: coarse elements, few lines, no rays.
pub fn cheap(plan: &mut Plan) {
    plan.trace.max_edge_m = 0.4;
    plan.trace.soil_cell_m = 0.2;
    plan.light.direct_line_area_m2 = plan.scale.ground_area_m2 / 2e3;
    plan.light.tolerance.absorbed = 1e-9;
    if let Some(sampling) = &mut plan.trace.sampling {
        sampling.line_area_m2 = plan.scale.ground_area_m2 / 60.0;
        sampling.least_samples = 0.0;
    }
}

/// A number as users never mean it: from a few that coincide, or of any size.
fn wild_number(dice: &mut Dice) -> f64 {
    let sign = [1.0, -1.0][dice.below(2)];
    match dice.below(4) {
        0 => [0.0, 0.5, 1.0, 1.0 / 3.0, 0.1][dice.below(5)],
        1 => sign * 10f64.powf(14.0 * dice.unit() - 9.0),
        _ => dice.unit(),
    }
}

fn wild_triangle(dice: &mut Dice, earlier: &[[DVec3; 3]]) -> [DVec3; 3] {
    let point =
        |dice: &mut Dice| DVec3::new(wild_number(dice), wild_number(dice), wild_number(dice));
    let fresh = [point(dice), point(dice), point(dice)];
    let old = |dice: &mut Dice| earlier[dice.below(earlier.len())];
    match dice.below(8) {
        // the same again, turned over or from another corner on
        0 if !earlier.is_empty() => {
            let [a, b, c] = old(dice);
            [[a, b, c], [a, c, b], [b, c, a]][dice.below(3)]
        }
        // on an edge of another one
        1 if !earlier.is_empty() => {
            let [a, b, _] = old(dice);
            [a, a.lerp(b, [0.5, 1.0, 2.0][dice.below(3)]), fresh[2]]
        }
        // a hair beside another one
        2 if !earlier.is_empty() => {
            let by = DVec3::Z * 10f64.powf(-15.0 * dice.unit());
            old(dice).map(|v| v + by)
        }
        // small, anywhere
        3 => {
            let size = 10f64.powf(-12.0 * dice.unit());
            [1, 2].iter().fold(fresh, |mut t, &k| {
                t[k] = t[0] + size * (t[k] - t[0]);
                t
            })
        }
        // level, or standing
        4 => {
            let axis = dice.below(3);
            fresh.map(|mut v| {
                v[axis] = fresh[0][axis];
                v
            })
        }
        // a needle, or a line
        5 => {
            let width = [0.0, 1e-12, 1e-6, 1e-3][dice.below(4)];
            let [a, b, c] = fresh;
            [a, b, a.lerp(b, dice.unit()) + width * (c - a)]
        }
        6 => [fresh[0]; 3],
        _ => fresh,
    }
}

/// A face in the place of another one: the same, turned over, a rounding or 1e-9 m away, or a part of it.
fn twin(dice: &mut Dice, [a, b, c]: [DVec3; 3]) -> [DVec3; 3] {
    let within = |s: f64, t: f64| a + s * (b - a) + t * (c - a);
    let twin = match dice.below(5) {
        0 => [a, b, c],
        1 => [b, c, a],
        2 => [a, b, c].map(|v| v * (1.0 + f64::EPSILON)),
        3 => {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            [a, b, c].map(|v| v + 1e-9 * normal)
        }
        _ => [within(0.1, 0.2), within(0.7, 0.1), within(0.3, 0.6)],
    };
    let [a, b, c] = twin;
    [[a, b, c], [a, c, b]][dice.below(2)]
}

/// The geometry of a wild scene as a file, read through the door for all input. Of a `doubled` one, every other
/// triangle has a twin or two in its plane.
///
/// # Errors
///
/// Gives the message of a refusal.
pub fn wild(seed: u64, doubled: bool) -> Result<Scene, String> {
    let mut dice = Dice(seed);
    let mut triangles: Vec<[DVec3; 3]> = Vec::new();
    for _ in 0..1 + dice.below(12) {
        let triangle = wild_triangle(&mut dice, &triangles);
        triangles.push(triangle);
    }
    if doubled {
        for k in 0..triangles.len() {
            for _ in 0..dice.below(4) / 2 {
                let twin = twin(&mut dice, triangles[k]);
                triangles.push(twin);
            }
        }
    }
    let mut text = String::new();
    for (k, triangle) in triangles.iter().enumerate() {
        let leaf = [0, 1 + k % 3][usize::from(dice.below(5) > 0)];
        text += &format!("p 1 100001{leaf:03}001 3");
        for v in triangle {
            text += &format!(" {} {} {}", v.x, v.y, v.z);
        }
        text += "\n";
    }
    let unit = [Unit::Metre, Unit::Centimetre, Unit::Millimetre][dice.below(3)];
    let file = can::parse("wild.can", text.as_bytes()).map_err(|e| e.to_string())?;
    let corners = [0.0, 0.0, wild_number(&mut dice), wild_number(&mut dice)];
    let geometry = Geometry {
        files: vec![file],
        pattern: (dice.below(2) > 0)
            .then(|| Rectangle::from_corners(corners))
            .flatten(),
        soil: (dice.below(2) > 0).then(|| wild_number(&mut dice)),
        unit,
        up: Up::Z,
    };
    let (canopy, origins) = build_canopy(geometry).map_err(|e| e.to_string())?;
    nestrad_common::inspection::inspect(&canopy, &origins);
    Ok(lit(&mut dice, canopy))
}

fn lit(dice: &mut Dice, canopy: Canopy) -> Scene {
    let bands = 1 + dice.below(3);
    let band = |b: usize, dice: &mut Dice| Band {
        name: format!("B{b}"),
        soil_albedo: [0.0, 0.5, 1.0][dice.below(3)],
        materials: canopy
            .materials
            .iter()
            .map(|_| match dice.below(4) {
                0 => LeafOptics::default(),
                1 => LeafOptics::symmetric(0.5, 0.5),
                _ => dice.leaf(),
            })
            .collect(),
    };
    let bands: Vec<Band> = (0..bands).map(|b| band(b, dice)).collect();
    let suns = (0..dice.below(4))
        .map(|_| {
            let zenith = [0.0, 45.0, 60.0, 89.9, 89.99, 90.0 * dice.unit()][dice.below(6)];
            let azimuth = [0.0, 90.0, 45.0, 360.0 * dice.unit()][dice.below(4)];
            let mut direction = from_zenith(zenith, azimuth);
            direction.z = direction.z.min(-1e-4);
            Source {
                direction: direction.normalize(),
                irradiance_W_m2: bands
                    .iter()
                    .map(|_| [0.0, 1e-12, 100.0, 1e12][dice.below(4)])
                    .collect(),
            }
        })
        .collect();
    Scene {
        sensors: Arc::default(),
        canopy: Arc::new(canopy),
        optics: Arc::new(Optics { bands }),
        light: Arc::new(Light { suns, sky: None }),
    }
}
