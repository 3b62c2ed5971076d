//! The order that a scene is solved in, which does not depend on the order of the input.
//!
//! Sums are rounded in their order, rays have random numbers by the number of their element, and leaves in
//! one place lie by rising number. So triangles are sorted before anything is computed, and results are
//! handed back in the order of the input: permuting the input permutes the output, bit for bit.

use std::cmp::Ordering;

use glam::DVec3;
use nestrad_common::optics::Band;
use nestrad_common::problem::Problem;
use nestrad_common::scene::{Organ, Scene};
use rayon::prelude::*;

use crate::solution::{ItemLight, Solution};

/// A problem in an order of its own.
pub struct Ordered {
    /// The same problem, its triangles, organs and materials sorted.
    pub problem: Problem,
    /// Where each triangle stood before.
    triangle: Vec<u32>,
    /// Where each organ stood before.
    organ: Vec<u32>,
}

impl Ordered {
    /// Sorts a problem.
    pub fn of(problem: &Problem) -> Self {
        let scene = &problem.scene;
        let organ = sorted(scene.organs.len(), |a, b| {
            compared(&scene.organs[a], &scene.organs[b])
        });
        let material = sorted(scene.materials.len(), |a, b| {
            scene.materials[a].cmp(&scene.materials[b])
        });
        let (organ_at, material_at) = (places(&organ), places(&material));
        let keys: Vec<Key> = (0..scene.triangles.len())
            .into_par_iter()
            .map(|t| Key {
                organ: organ_at[scene.organ[t] as usize],
                along: middle(&scene.triangles[t]).dot(ASIDE),
                material: material_at[scene.material[t] as usize],
            })
            .collect();
        let triangle = sorted(scene.triangles.len(), |a, b| {
            let (k, l) = (&keys[a], &keys[b]);
            k.organ
                .cmp(&l.organ)
                .then_with(|| k.along.total_cmp(&l.along))
                .then_with(|| by_vertices(&scene.triangles[a], &scene.triangles[b]))
                .then_with(|| k.material.cmp(&l.material))
        });
        let band = |band: &Band| Band {
            materials: taken(&band.materials, &material),
            ..band.clone()
        };
        Self {
            problem: Problem {
                scene: Scene {
                    triangles: taken(&scene.triangles, &triangle),
                    organ: triangle.iter().map(|&t| keys[t as usize].organ).collect(),
                    material: triangle
                        .iter()
                        .map(|&t| keys[t as usize].material)
                        .collect(),
                    organs: taken(&scene.organs, &organ),
                    materials: taken(&scene.materials, &material),
                    ..*scene
                },
                bands: problem.bands.iter().map(band).collect(),
                sources: problem.sources.clone(),
                sky_directions: problem.sky_directions,
            },
            triangle,
            organ,
        }
    }

    /// A solution of the sorted problem, in the order of the input.
    pub fn back(&self, solution: Solution) -> Solution {
        let bands = self.problem.bands.len();
        let items = |sorted: &[ItemLight], before: &[u32]| {
            let mut items = vec![ItemLight::default(); sorted.len()];
            for (from, &to) in sorted.chunks_exact(bands).zip(before) {
                items[to as usize * bands..][..bands].copy_from_slice(from);
            }
            items
        };
        let areas = |sorted: &[f64], before: &[u32]| {
            let mut areas = vec![0.0; sorted.len()];
            for (&from, &to) in sorted.iter().zip(before) {
                areas[to as usize] = from;
            }
            areas
        };
        let mut organ_bias_W = vec![0.0; solution.organ_bias_W.len()];
        let bias_W = solution.organ_bias_W.chunks_exact(bands);
        for (from, &to) in bias_W.zip(&self.organ) {
            organ_bias_W[to as usize * bands..][..bands].copy_from_slice(from);
        }
        Solution {
            organ_bias_W,
            organs: items(&solution.organs, &self.organ),
            triangles: items(&solution.triangles, &self.triangle),
            organ_area_m2: areas(&solution.organ_area_m2, &self.organ),
            triangle_area_m2: areas(&solution.triangle_area_m2, &self.triangle),
            ..solution
        }
    }
}

/// What triangles are sorted by, before their vertices.
struct Key {
    organ: u32,
    along: f64,
    material: u32,
}

/// Triangles of an organ are sorted along a direction in which hardly any two lie level: a scene that was
/// moved, and so rounded, keeps its order.
const ASIDE: DVec3 = DVec3::new(0.537_767_139, 0.313_033_187, 0.782_811_373);

fn middle([a, b, c]: &[DVec3; 3]) -> DVec3 {
    *a + *b + *c
}

/// Numbers by value, and other names by length first.
fn compared(a: &Organ, b: &Organ) -> Ordering {
    let short_first = |a: &str, b: &str| a.len().cmp(&b.len()).then_with(|| a.cmp(b));
    short_first(&a.plant, &b.plant).then_with(|| short_first(&a.id, &b.id))
}

fn by_vertices(a: &[DVec3; 3], b: &[DVec3; 3]) -> Ordering {
    let numbers = |t: &[DVec3; 3]| t.map(|v| v.to_array());
    let (a, b) = (numbers(a), numbers(b));
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.fold(Ordering::Equal, |so_far, (a, b)| {
        so_far.then_with(|| a.total_cmp(b))
    })
}

/// The numbers below `n`, sorted; what compares equal stays in order.
fn sorted(n: usize, by: impl Fn(usize, usize) -> Ordering + Sync) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.par_sort_by(|&a, &b| by(a as usize, b as usize));
    order
}

/// Where each number stands in an order.
fn places(order: &[u32]) -> Vec<u32> {
    let mut places = vec![0; order.len()];
    for (place, &k) in order.iter().enumerate() {
        places[k as usize] = place as u32;
    }
    places
}

fn taken<T: Clone>(from: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&k| from[k as usize].clone()).collect()
}
