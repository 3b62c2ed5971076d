//! Triangles as they travel; see `Mesh` in `near_field.proto`. Every worker needs them: they are to be small.

use pco::ChunkConfig;
use pco::data_types::Number;
use pco::errors::PcoError;
use pco::standalone::{DecompressorItem, FileDecompressor, simple_compress};
use thiserror::Error;

use crate::v1;

/// Coordinates of the corners of a triangle, metres.
pub type Triangle = [[f64; 3]; 3];

/// Packs triangles in their order.
pub fn pack(triangles: impl ExactSizeIterator<Item = Triangle>) -> v1::Mesh {
    let count = triangles.len();
    let mut vertices = Vertices::new(count);
    triangles.flatten().for_each(|corner| vertices.add(corner));
    let Vertices {
        coordinates_m: [x, y, z],
        corners,
        ..
    } = vertices;
    let (((x_m, y_m), z_m), packed) = rayon::join(
        || rayon::join(|| rayon::join(|| packed(&x), || packed(&y)), || packed(&z)),
        || packed(&corners),
    );
    v1::Mesh {
        triangles: count as u32,
        vertices: x.len() as u32,
        x_m,
        y_m,
        z_m,
        corners: packed,
    }
}

fn packed<T: Number>(numbers: &[T]) -> Vec<u8> {
    simple_compress(numbers, &ChunkConfig::default())
        .expect("all that can be refused is a configuration other than the default")
}

/// Why triangles cannot be unpacked.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum MeshFault {
    /// These are no packed numbers.
    #[error("{what} of the mesh cannot be unpacked: {reason}")]
    Packing {
        /// What is packed.
        what: &'static str,
        /// What is wrong with it.
        reason: PcoError,
    },
    /// There are more numbers than announced, or fewer.
    #[error("mesh with {found} {what}, expected {expected}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many there are, at least.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A number is out of its range.
    #[error("mesh with {what} out of range")]
    Range {
        /// What is out of range.
        what: &'static str,
    },
}

/// Unpacks what [`pack`] packed; nothing in it is trusted, but for how many triangles and vertices there are to
/// be: memory is taken for as many at most.
pub fn unpack<P: From<[f64; 3]> + Copy>(mesh: &v1::Mesh) -> Result<Vec<[P; 3]>, MeshFault> {
    let vertices = vertices::<P>(mesh)?;
    let corners = unpacked::<u32>(&mesh.corners, 3 * mesh.triangles as usize, "corners")?;
    let mut triangles = Vec::with_capacity(corners.len() / 3);
    let mut used = 0;
    for &of in corners.as_chunks::<3>().0 {
        let places = of.map(|back| {
            used += usize::from(back == 0);
            // the last vertex that was used stands before `used`
            used.wrapping_sub(back.max(1) as usize)
        });
        let [Some(&a), Some(&b), Some(&c)] = places.map(|place| vertices.get(place)) else {
            return Err(MeshFault::Range { what: "corners" });
        };
        triangles.push([a, b, c]);
    }
    counted("vertices", used, vertices.len())?;
    Ok(triangles)
}

fn vertices<P: From<[f64; 3]>>(mesh: &v1::Mesh) -> Result<Vec<P>, MeshFault> {
    let axis = |packed: &[u8], what| {
        let numbers = unpacked::<f64>(packed, mesh.vertices as usize, what)?;
        if numbers.iter().all(|x| x.is_finite()) {
            return Ok(numbers);
        }
        Err(MeshFault::Range { what })
    };
    let x = axis(&mesh.x_m, "x_m")?;
    let y = axis(&mesh.y_m, "y_m")?;
    let z = axis(&mesh.z_m, "z_m")?;
    let points = x.iter().zip(&y).zip(&z);
    Ok(points.map(|((&x, &y), &z)| P::from([x, y, z])).collect())
}

/// So many numbers, chunk by chunk: none is begun that holds more.
fn unpacked<T: Number>(
    packed: &[u8],
    expected: usize,
    what: &'static str,
) -> Result<Vec<T>, MeshFault> {
    let fault = |reason| MeshFault::Packing { what, reason };
    let (file, mut rest) = FileDecompressor::new(packed).map_err(fault)?;
    let mut numbers: Vec<T> = Vec::new();
    while let DecompressorItem::Chunk(mut chunk) = file.chunk_decompressor(rest).map_err(fault)? {
        let from = numbers.len();
        let found = from + chunk.n();
        if found > expected {
            return counted(what, found, expected).map(|()| numbers);
        }
        numbers.resize(found, T::default());
        chunk.read(&mut numbers[from..]).map_err(fault)?;
        rest = chunk.into_src();
    }
    counted(what, numbers.len(), expected)?;
    Ok(numbers)
}

fn counted(what: &'static str, found: usize, expected: usize) -> Result<(), MeshFault> {
    if found == expected {
        return Ok(());
    }
    Err(MeshFault::Count {
        what,
        found,
        expected,
    })
}

/// Vertices of a mesh, of which most are corners of several triangles that stand close together in it.
struct Vertices {
    coordinates_m: [Vec<f64>; 3],
    corners: Vec<u32>,
    /// The last vertex with each hash, counted from 1.
    last: Vec<u32>,
}

/// Bits of a hash: as many places are searched for a vertex.
const HASH_BITS: u32 = 16;

impl Vertices {
    fn new(triangles: usize) -> Self {
        Self {
            coordinates_m: [(); 3].map(|()| Vec::with_capacity(triangles)),
            corners: Vec::with_capacity(3 * triangles),
            last: vec![0; 1 << HASH_BITS],
        }
    }

    fn add(&mut self, point: [f64; 3]) {
        let bits = point.map(f64::to_bits);
        let used = self.coordinates_m[0].len() as u32;
        let last = &mut self.last[hash(bits)];
        if *last > 0 {
            let number = *last as usize - 1;
            let known = self.coordinates_m.each_ref().map(|of| of[number].to_bits());
            if known == bits {
                self.corners.push(used + 1 - *last);
                return;
            }
        }
        *last = used + 1;
        self.corners.push(0);
        for (coordinates, x) in self.coordinates_m.iter_mut().zip(point) {
            coordinates.push(x);
        }
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
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_vertex_is_written_once() {
        let mut vertices = Vertices::new(2);
        for point in [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0; 3],
            // another number, though it is equal
            [-0.0, 0.0, 0.0],
        ] {
            vertices.add(point);
        }
        assert_eq!(vertices.corners, [0, 0, 0, 2, 1, 0, 0]);
        assert_eq!(vertices.coordinates_m[0].len(), 5);
        assert!(vertices.coordinates_m[0][4].is_sign_negative());
    }

    /// A strip of leaf, written in micrometres.
    fn strip(triangles: usize) -> impl ExactSizeIterator<Item = Triangle> {
        let point = |k: usize| {
            let (sin, cos) = (k as f64 / 7.0).sin_cos();
            [sin, cos, k as f64 / 100.0].map(|x| (1e6 * x).round() / 1e6)
        };
        (0..triangles).map(move |t| [t, t + 1, t + 2].map(point))
    }

    #[test]
    fn coordinates_of_few_digits_take_little_room() {
        let n = 20_000;
        let mesh = pack(strip(n));
        let bytes = mesh.x_m.len() + mesh.y_m.len() + mesh.z_m.len() + mesh.corners.len();
        assert!(bytes < 8 * n, "{bytes} bytes of {n} triangles");
        assert_eq!(unpack(&mesh), Ok(strip(n).collect()));
    }

    #[test]
    fn what_is_not_there_is_refused() {
        type Spoil = fn(&mut v1::Mesh);
        let spoilt: [(Spoil, &str); 8] = [
            (
                |m| m.corners = packed(&[0u32, 0, 4, 2, 1, 0]),
                "corners out of range",
            ),
            (
                |m| m.corners = packed(&[0u32, 0, u32::MAX, 2, 1, 0]),
                "corners out of range",
            ),
            (
                |m| m.corners = packed(&[1u32, 0, 0, 0, 1, 0]),
                "corners out of range",
            ),
            (
                |m| m.corners = packed(&[0u32, 0, 0, 0, 1, 0]),
                "corners out of range",
            ),
            (
                |m| m.corners = packed(&[0u32, 0, 0, 2, 1, 1]),
                "3 vertices, expected 4",
            ),
            (|m| m.triangles = 1, "6 corners, expected 3"),
            (|m| m.vertices = 5, "4 x_m, expected 5"),
            (
                |m| m.y_m = packed(&[0.0, 1.0, f64::NAN, 0.0]),
                "y_m out of range",
            ),
        ];
        assert_eq!(pack(strip(2)).corners, packed(&[0u32, 0, 0, 2, 1, 0]));
        for (spoil, expected) in spoilt {
            let mut mesh = pack(strip(2));
            spoil(&mut mesh);
            let fault = unpack::<[f64; 3]>(&mesh).err().unwrap().to_string();
            assert!(fault.contains(expected), "{fault}, expected {expected}");
        }
        let empty = v1::Mesh::default();
        assert!(matches!(
            unpack::<[f64; 3]>(&empty),
            Err(MeshFault::Packing { .. })
        ));
    }

    proptest! {
        #[test]
        fn triangles_come_back(
            points in prop::collection::vec(prop::array::uniform3(-1e9f64..1e9), 1..40),
            corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..80),
        ) {
            let triangles: Vec<Triangle> =
                corners.iter().map(|of| of.map(|corner| *corner.get(&points))).collect();
            prop_assert_eq!(unpack(&pack(triangles.iter().copied())), Ok(triangles));
        }

        #[test]
        fn a_mesh_with_a_few_wrong_bytes_is_refused_or_taken(
            wrong in prop::collection::vec((0..4usize, any::<prop::sample::Index>(), any::<u8>()), 1..6),
        ) {
            let mut mesh = pack(strip(30));
            for (of, at, byte) in wrong {
                let packed = [&mut mesh.x_m, &mut mesh.y_m, &mut mesh.z_m, &mut mesh.corners];
                let bytes = packed.into_iter().nth(of).unwrap();
                let at = at.index(bytes.len());
                bytes[at] = byte;
            }
            if let Ok(triangles) = unpack::<[f64; 3]>(&mesh) {
                prop_assert_eq!(triangles.len(), 30);
            }
        }
    }
}
