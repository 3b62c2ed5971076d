//! Triangles as they travel; see `Mesh` in `near_field.proto`. Every worker needs them: they are to be small.

use glam::DVec3;
use nestrad_common::canopy::Welder;
use pco::ChunkConfig;
use pco::data_types::Number;
use pco::errors::PcoError;
use pco::standalone::{DecompressorItem, FileDecompressor, simple_compress};
use thiserror::Error;

use crate::v1;

/// Packs triangles (vertices in metres) in their order.
pub(crate) fn pack(triangles: impl ExactSizeIterator<Item = [DVec3; 3]>) -> v1::Mesh {
    let count = triangles.len();
    let (mut welder, mut vertices) = (Welder::default(), Vec::new());
    let mut corners = Vec::with_capacity(3 * count);
    for vertex in triangles.flatten() {
        let used = vertices.len() as u32;
        let number = welder.number(vertex, &mut vertices);
        corners.push(used - number.min(used));
    }
    let axis = |axis: usize| packed(&vertices.iter().map(|v| v[axis]).collect::<Vec<f64>>());
    let (((x_m, y_m), z_m), corners) = rayon::join(
        || rayon::join(|| rayon::join(|| axis(0), || axis(1)), || axis(2)),
        || packed(&corners),
    );
    v1::Mesh {
        triangles: count as u32,
        vertices: vertices.len() as u32,
        x_m,
        y_m,
        z_m,
        corners,
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
pub(crate) fn unpack<T: FromIterator<[DVec3; 3]>>(mesh: &v1::Mesh) -> Result<T, MeshFault> {
    let vertices = vertices(mesh)?;
    let corners = unpacked::<u32>(&mesh.corners, 3 * mesh.triangles as usize, "corners")?;
    let mut used = 0;
    let triangle = |of: &[u32; 3]| {
        let places = of.map(|back| {
            used += usize::from(back == 0);
            // the last vertex that was used stands before `used`
            used.wrapping_sub(back.max(1) as usize)
        });
        let [Some(&a), Some(&b), Some(&c)] = places.map(|place| vertices.get(place)) else {
            return Err(MeshFault::Range { what: "corners" });
        };
        Ok([a, b, c])
    };
    let triangles = corners.as_chunks::<3>().0.iter().map(triangle);
    let triangles = triangles.collect::<Result<T, MeshFault>>()?;
    counted("vertices", used, vertices.len())?;
    Ok(triangles)
}

fn vertices(mesh: &v1::Mesh) -> Result<Vec<DVec3>, MeshFault> {
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
    Ok(points.map(|((&x, &y), &z)| DVec3::new(x, y, z)).collect())
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A strip of leaf, written in micrometres.
    fn strip(triangles: usize) -> impl ExactSizeIterator<Item = [DVec3; 3]> {
        let point = |k: usize| {
            let (sin, cos) = (k as f64 / 7.0).sin_cos();
            (1e6 * DVec3::new(sin, cos, k as f64 / 100.0)).round() / 1e6
        };
        (0..triangles).map(move |t| [t, t + 1, t + 2].map(point))
    }

    #[test]
    fn coordinates_of_few_digits_take_little_room() {
        let n = 20_000;
        let mesh = pack(strip(n));
        let bytes = mesh.x_m.len() + mesh.y_m.len() + mesh.z_m.len() + mesh.corners.len();
        assert!(bytes < 8 * n, "{bytes} bytes of {n} triangles");
        assert_eq!(unpack::<Vec<_>>(&mesh), Ok(strip(n).collect()));
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
            let fault = unpack::<Vec<_>>(&mesh).err().unwrap().to_string();
            assert!(fault.contains(expected), "{fault}, expected {expected}");
        }
        let empty = v1::Mesh::default();
        assert!(matches!(
            unpack::<Vec<_>>(&empty),
            Err(MeshFault::Packing { .. })
        ));
    }

    proptest! {
        #[test]
        fn triangles_come_back(
            points in prop::collection::vec(prop::array::uniform3(-1e9f64..1e9), 1..40),
            corners in prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 0..80),
        ) {
            let point = |corner: prop::sample::Index| DVec3::from_array(*corner.get(&points));
            let triangles: Vec<[DVec3; 3]> = corners.iter().map(|of| of.map(point)).collect();
            prop_assert_eq!(unpack::<Vec<_>>(&pack(triangles.iter().copied())), Ok(triangles));
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
            if let Ok(triangles) = unpack::<Vec<_>>(&mesh) {
                prop_assert_eq!(triangles.len(), 30);
            }
        }
    }
}
