//! What is in a scene, and what is odd about it.

use std::collections::{BTreeSet, HashMap};
use std::hash::{DefaultHasher, Hash, Hasher};

use glam::{DVec2, DVec3};
use serde::Serialize;

use crate::assemble::Origins;
use crate::scene::{Material, Scene};

/// Facts of a scene. Lengths in metres, in the user's coordinates.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Inspection {
    /// As given, soil triangles included.
    pub triangles: usize,
    /// Groups of triangles that are reported as one.
    pub organs: usize,
    /// Groups of organs.
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
    /// One-sided area of all but soil per area of ground: of the pattern, or of the box around an
    /// isolated scene. `None` where that ground has no area.
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
    /// How far the scene reaches beyond the pattern's edge; 0 for an isolated scene. It comes in
    /// again on the other side.
    pub overhang_m: f64,
    /// Each a sentence, lower-case.
    pub warnings: Vec<String>,
}

/// What there is of a material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MaterialFacts {
    /// As in messages: `leaf of species 1`, or the name in an OBJ file.
    pub name: String,
    /// How many.
    pub triangles: usize,
    /// One-sided area, m².
    pub area_m2: f64,
}

/// Beyond this distance the user's coordinates, as doubles, are coarser than a micrometre.
const FAR_M: f64 = 1e-6 / f64::EPSILON;

/// Looks through a scene; `origins` serves to name file and line in the warnings.
pub fn inspect(scene: &Scene, origins: &Origins) -> Inspection {
    let mut facts = Inspection {
        triangles: scene.triangles.len(),
        organs: scene.organs.len(),
        plants: scene
            .organs
            .iter()
            .map(|organ| &organ.plant)
            .collect::<BTreeSet<_>>()
            .len(),
        pattern_m: scene.pattern.map(|pattern| pattern.size_m.to_array()),
        soil_z_m: scene.soil_z_m.map(|z| z + scene.origin_m.z),
        ..Inspection::default()
    };
    let (lower, upper) = bounds(scene);
    facts.lower_m = (lower + scene.origin_m).to_array();
    facts.upper_m = (upper + scene.origin_m).to_array();
    facts.overhang_m = scene.pattern.map_or(0.0, |pattern| {
        let below = pattern.min_m - lower.truncate();
        let beyond = upper.truncate() - (pattern.min_m + pattern.size_m);
        below.max(beyond).max_element().max(0.0)
    });

    facts.areas(scene, origins, (upper - lower).truncate());
    facts.find_duplicates(scene, origins);
    facts.find_below_soil(scene, origins);
    let farthest = (lower + scene.origin_m)
        .abs()
        .max((upper + scene.origin_m).abs());
    if farthest.max_element() > FAR_M {
        facts.warnings.push(format!(
            "coordinates reach {} m from zero, where they are rounded to more than a micrometre",
            farthest.max_element()
        ));
    }
    if let Some(pattern) = scene.pattern
        && facts.overhang_m > 10.0 * pattern.size_m.max_element()
    {
        facts.warnings.push(format!(
            "the scene reaches {} m beyond a pattern of {} m x {} m: is the unit right?",
            facts.overhang_m, pattern.size_m.x, pattern.size_m.y
        ));
    }
    facts
}

impl Inspection {
    fn areas(&mut self, scene: &Scene, origins: &Origins, extent: DVec2) {
        let new = |material: &Material| MaterialFacts {
            name: material.to_string(),
            triangles: 0,
            area_m2: 0.0,
        };
        self.materials = scene.materials.iter().map(new).collect();
        let mut smallest = f64::INFINITY;
        let mut first_degenerate = None;
        for (index, (triangle, &material)) in
            scene.triangles.iter().zip(&scene.material).enumerate()
        {
            let area = area_m2(triangle);
            let of = &mut self.materials[material as usize];
            of.triangles += 1;
            of.area_m2 += area;
            self.largest_m2 = self.largest_m2.max(area);
            if area > rounding_m2(triangle, scene.origin_m) {
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
        let ground = scene.pattern.map_or(extent.x * extent.y, |p| p.area_m2());
        let materials = self.materials.iter().zip(&scene.materials);
        let plants: f64 = materials
            .filter(|(_, material)| **material != Material::Soil)
            .map(|(facts, _)| facts.area_m2)
            .sum();
        self.area_index = (ground > 0.0).then(|| plants / ground);
    }

    fn find_duplicates(&mut self, scene: &Scene, origins: &Origins) {
        let mut hashed: Vec<(u64, u32)> = scene
            .triangles
            .iter()
            .zip(0..)
            .map(|(triangle, index)| (hash(&sorted(triangle)), index))
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
                let times = seen.entry(sorted(&scene.triangles[index])).or_insert(0);
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

    fn find_below_soil(&mut self, scene: &Scene, origins: &Origins) {
        let Some(soil) = scene.soil_z_m else {
            return;
        };
        let below = |triangle: &[DVec3; 3]| triangle.iter().any(|vertex| vertex.z < soil);
        let mut found = (0..scene.triangles.len()).filter(|&i| below(&scene.triangles[i]));
        if let Some(first) = found.next() {
            self.below_soil = 1 + found.count();
            self.warn(
                self.below_soil,
                "partly or wholly below the soil plane",
                origins,
                first,
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

fn bounds(scene: &Scene) -> (DVec3, DVec3) {
    scene.triangles.iter().flatten().fold(
        (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |(lower, upper), vertex| (lower.min(*vertex), upper.max(*vertex)),
    )
}

fn area_m2(triangle: &[DVec3; 3]) -> f64 {
    let [a, b, c] = *triangle;
    0.5 * (b - a).cross(c - a).length()
}

/// The area that rounding the user's coordinates to doubles could have made of nothing.
fn rounding_m2(triangle: &[DVec3; 3], origin: DVec3) -> f64 {
    let [a, b, c] = *triangle;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
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
