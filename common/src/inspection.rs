//! What is in a scene, and what is odd about it.

use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::RangeInclusive;

use glam::{DVec2, DVec3};
use serde::Serialize;

use crate::canopy::{Canopy, Kind, Material};
use crate::formats::Origins;
use crate::geometry::{area, longest_edge};
use crate::light::{Light, Source};

/// Facts of a canopy and its light. Lengths in metres, in the user's coordinates.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Inspection {
    /// As given, soil triangles included.
    pub triangles: usize,
    /// Groups of triangles that are reported as one.
    pub organs: usize,
    /// Groups of organs; soil and structures are none.
    pub plants: usize,
    /// In order of first appearance.
    pub materials: Vec<MaterialFacts>,
    /// Lower corner of the box around all triangles.
    pub lower_m: [f64; 3],
    /// Upper corner of the box around all triangles.
    pub upper_m: [f64; 3],
    /// Extent of the pattern in x and y.
    pub pattern_m: Option<[f64; 2]>,
    /// Height of the soil plane.
    pub soil_z_m: Option<f64>,
    /// One-sided area of leaves and stems per area of ground: of the pattern, or of the box around an
    /// isolated canopy. `None` where that ground has no area.
    pub area_index: Option<f64>,
    /// One-sided area of the smallest triangle, degenerate ones left out, m².
    pub smallest_m2: f64,
    /// One-sided area of the largest triangle, m².
    pub largest_m2: f64,
    /// Triangles without area, as far as their coordinates can tell: they get no light.
    pub degenerate: usize,
    /// Triangles with the same three vertices as an earlier one, in any order.
    pub duplicates: usize,
    /// Triangles that reach below the soil plane.
    pub below_soil: usize,
    /// How far the scene reaches beyond the pattern's edge; 0 for an isolated canopy. It comes in
    /// again on the other side.
    pub overhang_m: f64,
    /// Where the sun stands: the one parallel source, if there is just one.
    pub sun: Option<SunFacts>,
    /// Each a sentence, lower-case.
    pub warnings: Vec<String>,
}

/// Where the sun stands.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SunFacts {
    /// Above the horizon, degrees.
    pub elevation_deg: f64,
    /// From north (y), clockwise (east, x, is 90), degrees.
    pub azimuth_deg: f64,
}

impl SunFacts {
    /// Of the parallel sources of a light, if there is just one.
    pub fn of(suns: &[Source]) -> Option<Self> {
        let [sun] = suns else {
            return None;
        };
        Some(Self {
            elevation_deg: sun.elevation_deg(),
            azimuth_deg: sun.azimuth_deg(),
        })
    }
}

impl fmt::Display for SunFacts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            elevation_deg,
            azimuth_deg,
        } = self;
        write!(
            f,
            "{elevation_deg:.2} degrees above the horizon, azimuth {azimuth_deg:.2} degrees from north (y) through east (x)"
        )
    }
}

/// What there is of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialFacts {
    /// As in messages: `leaf of species 1`, or the name in an OBJ file.
    pub name: String,
    /// What it counts as.
    pub kind: Kind,
    /// How many.
    pub triangles: usize,
    /// One-sided area, m².
    pub area_m2: f64,
}

/// Beyond this distance the user's coordinates, as doubles, are coarser than a micrometre.
const FAR_M: f64 = 1e-6 / f64::EPSILON;

/// A scene that is smaller or larger than this is no canopy in metres, as likely as not.
const USUAL_EXTENT_M: RangeInclusive<f64> = 0.01..=10_000.0;

/// Looks through a canopy; `origins` serves to name file and line in the warnings.
pub fn inspect(canopy: &Canopy, origins: &Origins) -> Inspection {
    let mut facts = Inspection {
        triangles: canopy.len(),
        organs: canopy.organs.len(),
        plants: canopy
            .organs
            .iter()
            .zip(canopy.plants())
            .filter(|(_, is_plant)| *is_plant)
            .map(|(organ, _)| (&organ.species, &organ.plant))
            .collect::<BTreeSet<_>>()
            .len(),
        pattern_m: canopy.pattern.map(|pattern| pattern.size_m.to_array()),
        soil_z_m: canopy.soil_z_m.map(|z| z + canopy.origin_m.z),
        ..Inspection::default()
    };
    let (lower, upper) = canopy.bounds_m();
    facts.lower_m = (lower + canopy.origin_m).to_array();
    facts.upper_m = (upper + canopy.origin_m).to_array();
    facts.overhang_m = canopy.pattern.map_or(0.0, |pattern| {
        let below = pattern.min_m - lower.truncate();
        let beyond = upper.truncate() - (pattern.min_m + pattern.size_m);
        below.max(beyond).max_element().max(0.0)
    });

    facts.areas(canopy, origins, (upper - lower).truncate());
    facts.find_duplicates(canopy, origins);
    facts.find_below_soil(canopy, origins);
    facts.find_inside_out(canopy, origins);
    let farthest = (lower + canopy.origin_m)
        .abs()
        .max((upper + canopy.origin_m).abs());
    if farthest.max_element() > FAR_M {
        facts.warnings.push(format!(
            "coordinates reach {} m from zero: rounding errors there are larger than one micrometre",
            farthest.max_element()
        ));
    }
    let extent_m = (upper - lower).max_element();
    if !USUAL_EXTENT_M.contains(&extent_m) {
        facts.warnings.push(format!(
            "the whole scene is {} across: the unit may be wrong (m, cm or mm)",
            metres(extent_m)
        ));
    }
    if let Some(pattern) = canopy.pattern
        && facts.overhang_m > 10.0 * pattern.size_m.max_element()
    {
        facts.warnings.push(format!(
            "the scene reaches {} m beyond a pattern of {} m x {} m: is the unit right?",
            facts.overhang_m, pattern.size_m.x, pattern.size_m.y
        ));
    }
    facts
}

/// A length that may be of any order.
fn metres(length_m: f64) -> String {
    if (1e-3..1e6).contains(&length_m) {
        format!("{} m", (length_m * 1e6).round() / 1e6)
    } else {
        format!("{length_m:.1e} m")
    }
}

impl Inspection {
    /// Takes in the light, of these bands.
    pub fn add_light(&mut self, light: &Light, bands: &[&str]) {
        self.sun = SunFacts::of(&light.suns);
        self.warnings.extend(light.warnings(bands));
    }

    fn areas(&mut self, canopy: &Canopy, origins: &Origins, extent: DVec2) {
        let new = |(material, kind): (&Material, Kind)| MaterialFacts {
            name: material.to_string(),
            kind,
            triangles: 0,
            area_m2: 0.0,
        };
        let materials = canopy.materials.iter().zip(canopy.kinds());
        self.materials = materials.map(new).collect();
        let mut smallest = f64::INFINITY;
        let mut first_degenerate = None;
        for (index, triangle) in canopy.triangles().enumerate() {
            let corners = &triangle.corners_m;
            let area = area(corners);
            let of = &mut self.materials[triangle.material as usize];
            of.triangles += 1;
            of.area_m2 += area;
            self.largest_m2 = self.largest_m2.max(area);
            if area > rounding_m2(corners, canopy.origin_m) {
                smallest = smallest.min(area);
            } else {
                self.degenerate += 1;
                first_degenerate = first_degenerate.or(Some(index));
            }
        }
        if smallest.is_finite() {
            self.smallest_m2 = smallest;
        }
        if let Some(first) = first_degenerate {
            self.warn(
                self.degenerate,
                "without area, for which no light is computed",
                origins,
                first,
            );
        }
        let ground = canopy.pattern.map_or(extent.x * extent.y, |p| p.area_m2());
        let plants = self.materials.iter().filter(|of| of.kind.is_plant());
        let plants: f64 = plants.map(|of| of.area_m2).sum();
        self.area_index = (ground > 0.0).then(|| plants / ground);
    }

    fn find_duplicates(&mut self, canopy: &Canopy, origins: &Origins) {
        let mut hashed: Vec<(u64, u32)> = canopy
            .corners_m()
            .zip(0..)
            .map(|(corners, index)| (hash(&sorted(&corners)), index))
            .collect();
        hashed.sort_unstable();
        let mut first = None;
        for run in hashed
            .chunk_by(|a, b| a.0 == b.0)
            .filter(|run| run.len() > 1)
        {
            // equal hashes are nearly always equal triangles: this map stays small
            let mut seen = HashMap::new();
            for &(_, index) in run {
                let index = index as usize;
                let vertices = sorted(&canopy.triangle(index).corners_m);
                let times = seen.entry(vertices).or_insert(0);
                *times += 1;
                if *times > 1 {
                    self.duplicates += 1;
                    first = Some(first.map_or(index, |first: usize| first.min(index)));
                }
            }
        }
        if let Some(first) = first {
            self.warn(
                self.duplicates,
                "with the same vertices as an earlier one",
                origins,
                first,
            );
        }
    }

    fn find_below_soil(&mut self, canopy: &Canopy, origins: &Origins) {
        let Some(soil) = canopy.soil_z_m else {
            return;
        };
        let below = |corners: &[DVec3; 3]| corners.iter().any(|vertex| vertex.z < soil);
        let corners = canopy.corners_m().enumerate();
        let mut found = corners.filter(|(_, corners)| below(corners));
        if let Some((first, _)) = found.next() {
            self.below_soil = 1 + found.count();
            self.warn(
                self.below_soil,
                "partly or wholly below the soil plane",
                origins,
                first,
            );
        }
    }

    fn find_inside_out(&mut self, canopy: &Canopy, origins: &Origins) {
        let inside_out = canopy.solids().inside_out;
        if let Some(&first) = inside_out.first() {
            self.warn(
                inside_out.len(),
                "of closed stems turned inside out (the upper face looks inwards)",
                origins,
                first as usize,
            );
        }
    }

    fn warn(&mut self, count: usize, what: &str, origins: &Origins, first: usize) {
        let s = if count == 1 { "" } else { "s" };
        let place = origins.place(first);
        self.warnings
            .push(format!("{count} triangle{s} {what}, the first in {place}"));
    }
}

/// The area that rounding the user's coordinates to doubles could have made of nothing.
fn rounding_m2(triangle: &[DVec3; 3], origin: DVec3) -> f64 {
    let longest = longest_edge(triangle);
    let farthest = triangle
        .iter()
        .map(|vertex| (*vertex + origin).abs().max_element())
        .fold(0.0, f64::max);
    2.0 * f64::EPSILON * farthest.max(longest) * longest
}

/// Vertices as bits, in an order that does not depend on where the triangle begins or turns.
fn sorted(triangle: &[DVec3; 3]) -> [[u64; 3]; 3] {
    // adding zero makes 0 of -0
    let mut vertices = triangle.map(|vertex| vertex.to_array().map(|x| (x + 0.0).to_bits()));
    vertices.sort_unstable();
    vertices
}

fn hash(vertices: &[[u64; 3]; 3]) -> u64 {
    let mut hasher = DefaultHasher::new();
    vertices.hash(&mut hasher);
    hasher.finish()
}
