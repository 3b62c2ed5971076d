//! The geometry of a block as a message. Every worker needs it: it is to be small.

use glam::DVec3;
use nestrad_common::scene::Scene;
use nestrad_proto::v1;

use super::jobs::{BlockOf, world_message};
use crate::world::World;

/// The geometry of a block, as jobs carry it.
pub fn block_message(scene: &Scene, world: &World, block: &BlockOf) -> v1::Block {
    let mut vertices = Vertices::new(block.triangles.len());
    let mut runs: Vec<v1::TriangleRun> = Vec::new();
    let mut next_element = 0;
    for &(t, owned) in &block.triangles {
        let t = t as usize;
        for &point in &scene.triangles[t] {
            vertices.add(point);
        }
        let skipped_elements = world.elements.first[t] - next_element;
        next_element = world.elements.first[t + 1];
        let run = v1::TriangleRun {
            triangles: 1,
            skipped_elements,
            divisions: world.elements.divisions[t],
            owned,
            solid: world.solid[t],
        };
        match runs.last_mut() {
            Some(last) if continues(last, &run) => last.triangles += 1,
            _ => runs.push(run),
        }
    }
    v1::Block {
        world: Some(world_message(world)),
        vertices_m: vertices.coordinates_m,
        corners: vertices.corners,
        runs,
        owned_soil_cells: block.soil_cells.clone(),
    }
}

fn continues(last: &v1::TriangleRun, run: &v1::TriangleRun) -> bool {
    let alike = |r: &v1::TriangleRun| (r.divisions, r.owned, r.solid);
    run.skipped_elements == 0 && alike(last) == alike(run)
}

/// Vertices of a mesh, of which most are corners of several triangles that stand close together in it.
struct Vertices {
    coordinates_m: Vec<f64>,
    corners: Vec<u32>,
    /// The last vertex with each hash, counted from 1.
    last: Vec<u32>,
}

/// Bits of a hash: as many places are searched for a vertex.
const HASH_BITS: u32 = 16;

impl Vertices {
    fn new(triangles: usize) -> Self {
        Self {
            coordinates_m: Vec::with_capacity(3 * triangles),
            corners: Vec::with_capacity(3 * triangles),
            last: vec![0; 1 << HASH_BITS],
        }
    }

    fn add(&mut self, point: DVec3) {
        let bits = point.to_array().map(f64::to_bits);
        let used = self.coordinates_m.len() as u32 / 3;
        let last = &mut self.last[hash(bits)];
        if *last > 0 {
            let first = 3 * (*last as usize - 1);
            let known = &self.coordinates_m[first..first + 3];
            if known.iter().map(|x| x.to_bits()).eq(bits) {
                self.corners.push(used + 1 - *last);
                return;
            }
        }
        *last = used + 1;
        self.corners.push(0);
        self.coordinates_m.extend(point.to_array());
    }
}

fn hash(bits: [u64; 3]) -> usize {
    // multiplicative hashing (Knuth) of each coordinate by an odd number of its own
    let [x, y, z] = bits;
    let mixed = x
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(y.wrapping_mul(0xc2b2_ae3d_27d4_eb4f))
        .wrapping_add(z.wrapping_mul(0x1656_67b1_9e37_79f9));
    (mixed >> (64 - HASH_BITS)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vertex_is_written_once() {
        let mut vertices = Vertices::new(2);
        for point in [
            DVec3::ZERO,
            DVec3::X,
            DVec3::Y,
            DVec3::X,
            DVec3::Y,
            DVec3::ONE,
            // another number, though it is equal
            DVec3::new(-0.0, 0.0, 0.0),
        ] {
            vertices.add(point);
        }
        assert_eq!(vertices.corners, [0, 0, 0, 2, 1, 0, 0]);
        assert_eq!(vertices.coordinates_m.len(), 15);
        assert!(vertices.coordinates_m[12].is_sign_negative());
    }
}
