//! Finds vertices again: those of one place, bit for bit, get one number.

use glam::DVec3;

/// Numbers vertices as they come. Of those with one hash the last is remembered: triangles that share a vertex
/// stand close together in a mesh, so this finds nearly all, and takes the same little memory for any mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Welder {
    /// The last vertex with each hash, counted from 1.
    last: Vec<u32>,
}

/// Bits of a hash: as many places are searched for a vertex.
const HASH_BITS: u32 = 16;

impl Welder {
    /// The number of a vertex among `vertices`, to which it is added if it is not found.
    pub fn number(&mut self, vertex: DVec3, vertices: &mut Vec<DVec3>) -> u32 {
        if self.last.is_empty() {
            self.last.resize(1 << HASH_BITS, 0);
        }
        let bits = |v: DVec3| v.to_array().map(f64::to_bits);
        let last = &mut self.last[hash(bits(vertex))];
        if let Some(number) = last.checked_sub(1)
            && bits(vertices[number as usize]) == bits(vertex)
        {
            return number;
        }
        vertices.push(vertex);
        *last = vertices.len() as u32;
        *last - 1
    }
}

fn hash([x, y, z]: [u64; 3]) -> usize {
    // multiplicative hashing (Knuth) of each coordinate by an odd number of its own
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
    fn a_vertex_is_numbered_once() {
        let (mut welder, mut vertices) = (Welder::default(), Vec::new());
        let numbers = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0; 3],
            // another number, though it is equal
            [-0.0, 0.0, 0.0],
        ]
        .map(|v| welder.number(DVec3::from_array(v), &mut vertices));
        assert_eq!(numbers, [0, 1, 2, 1, 2, 3, 4]);
        assert_eq!(vertices.len(), 5);
        assert!(vertices[4].x.is_sign_negative());
    }
}
