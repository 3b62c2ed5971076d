//! The order that a canopy is computed in, which does not depend on the order of the input.
//!
//! Sums are rounded in their order, rays have random numbers by the number of their element, and leaves in
//! one place lie by rising number. So triangles are sorted before anything is computed, and results are
//! handed back in the order of the input: permuting the input permutes the output, bit for bit.

use std::cmp::Ordering;

use glam::DVec3;
use nestrad_common::canopy::{Canopy, Organ, Triangle};
use nestrad_common::optics::{Band, Optics};
use rayon::prelude::*;

/// Where the sorted triangles, organs and materials stand in the canopy.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Order {
    /// Of each sorted triangle, its number in the canopy.
    pub triangle: Vec<u32>,
    /// Of each sorted organ, its number in the canopy.
    pub organ: Vec<u32>,
    /// Of each sorted material, its number in the canopy.
    pub material: Vec<u32>,
}

impl Order {
    /// Sorts a canopy.
    pub fn of(canopy: &Canopy) -> Self {
        let organ = sorted(canopy.organs.len(), |a, b| {
            compared(&canopy.organs[a], &canopy.organs[b])
        });
        let material = sorted(canopy.materials.len(), |a, b| {
            canopy.materials[a].cmp(&canopy.materials[b])
        });
        let (organ_at, material_at) = (places(&organ), places(&material));
        let keys: Vec<Key> = (0..canopy.len())
            .into_par_iter()
            .map(|t| {
                let triangle = canopy.triangle(t);
                Key {
                    organ: organ_at[triangle.organ as usize],
                    along: middle(&triangle.corners_m).dot(ASIDE),
                    material: material_at[triangle.material as usize],
                }
            })
            .collect();
        let corners = |t: usize| canopy.triangle(t).corners_m;
        let triangle = sorted(canopy.len(), |a, b| {
            let (k, l) = (&keys[a], &keys[b]);
            k.organ
                .cmp(&l.organ)
                .then_with(|| k.along.total_cmp(&l.along))
                .then_with(|| by_vertices(&corners(a), &corners(b)))
                .then_with(|| k.material.cmp(&l.material))
        });
        Self {
            triangle,
            organ,
            material,
        }
    }

    /// The triangles of the canopy, sorted; organ and material as the canopy has them.
    pub fn triangles<'a>(
        &'a self,
        canopy: &'a Canopy,
    ) -> impl ExactSizeIterator<Item = Triangle> + 'a {
        self.triangle.iter().map(|&t| canopy.triangle(t as usize))
    }

    /// Sorted numbers of the organ and of the material of each sorted triangle.
    pub fn numbers(&self, canopy: &Canopy) -> (Vec<u32>, Vec<u32>) {
        let (organ_at, material_at) = (places(&self.organ), places(&self.material));
        let numbers = |t: Triangle| (organ_at[t.organ as usize], material_at[t.material as usize]);
        self.triangles(canopy).map(numbers).unzip()
    }

    /// What stands in the order of the canopy's materials, sorted.
    pub fn by_material<T: Clone>(&self, of_canopy: &[T]) -> Vec<T> {
        taken(of_canopy, &self.material)
    }

    /// Optics of the canopy for its sorted materials.
    pub fn optics(&self, optics: &Optics) -> Optics {
        let band = |band: &Band| Band {
            materials: self.by_material(&band.materials),
            ..band.clone()
        };
        Optics {
            bands: optics.bands.iter().map(band).collect(),
        }
    }
}

/// What stands in sorted order (`each` in a row for every item), back in the canopy's.
pub(crate) fn back<T: Clone + Default>(sorted: &[T], places: &[u32], each: usize) -> Vec<T> {
    let mut back = vec![T::default(); sorted.len()];
    for (from, &to) in sorted.chunks_exact(each.max(1)).zip(places) {
        back[to as usize * each..][..each].clone_from_slice(from);
    }
    back
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

/// Numbers by value, and other names by length first. Species come last: a name, which may be that of a file, tells
/// apart what would be the same without it, and has no say in the order of the rest.
fn compared(a: &Organ, b: &Organ) -> Ordering {
    let short_first = |a: &str, b: &str| a.len().cmp(&b.len()).then_with(|| a.cmp(b));
    short_first(&a.plant, &b.plant)
        .then_with(|| short_first(&a.id, &b.id))
        .then_with(|| short_first(&a.species, &b.species))
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
