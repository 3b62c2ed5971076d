//! A name for the bits that this kernel computes.

use std::sync::OnceLock;

use glam::DVec3;
use nestrad_proto::v1;

use crate::{Block, PackedRows, Tracer, trace_packed};

/// Names the results of this kernel on this machine: the same name, the same bits. It holds a digest of
/// the packed rows of a small job, so that a change of the kernel or of the format, or a machine whose sine differs in the last
/// bit, has another name.
pub fn kernel() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let rows = sample().unwrap_or_default();
        let mut hasher = blake3::Hasher::new();
        hasher.update(&rows.packed);
        let digest = hasher.finalize().to_hex();
        format!("nestrad {} {}", env!("CARGO_PKG_VERSION"), &digest[..16])
    })
}

/// Leaves and stems at odd places, over soil, with a far field; lines and rays.
fn sample() -> Option<PackedRows> {
    let mut state = 1u64;
    let mut random = || {
        // Knuth's MMIX generator: any will do
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let vector = |x, y, z| Some(v1::Vector { x, y, z });
    const TRIANGLES: usize = 60;
    let mut triangles = Vec::with_capacity(TRIANGLES);
    for _ in 0..TRIANGLES {
        let middle = [random(), random(), 0.1 + 0.8 * random()];
        let mut corner = || middle.map(|m| m + 0.3 * (random() - 0.5));
        triangles.push([corner(), corner(), corner()].map(DVec3::from_array));
    }
    let run = |solid| v1::TriangleRun {
        triangles: 1,
        divisions: 2,
        owned: true,
        solid,
        ..v1::TriangleRun::default()
    };
    let block = v1::Block {
        world: Some(v1::World {
            min_m: vector(0.0, 0.0, -0.1),
            max_m: vector(1.0, 1.0, 1.1),
            periodic: true,
            elements: 4 * TRIANGLES as u32,
            soil: Some(v1::SoilPlane {
                z_m: -0.1,
                cell_x_m: 0.5,
                cell_y_m: 0.5,
                cells_x: 2,
                cells_y: 2,
                ..v1::SoilPlane::default()
            }),
            sphere_radius_m: 0.4,
            far_levels: 5,
            far_bins: 3,
        }),
        mesh: None,
        runs: (0..TRIANGLES).map(|t| run(t % 3 == 0)).collect(),
        owned_soil: vec![v1::CellRun {
            cells: 4,
            skipped_cells: 0,
        }],
    };
    let lines = (0..8).map(|k| {
        let (sin, cos) = (0.3 + 0.7 * f64::from(k)).sin_cos();
        let z: f64 = 0.1 + 0.1 * f64::from(k);
        let r = (1.0 - z * z).sqrt();
        v1::Lines {
            direction: vector(r * cos, r * sin, z),
            random_x: random(),
            random_y: random(),
            random_count: random(),
            line_area_m2: 0.001,
            ..v1::Lines::default()
        }
    });
    let batch = v1::Batch {
        index: 1,
        lines: lines.collect(),
        rays: Some(v1::Rays {
            seed: 7,
            least_samples: 8.0,
            batches_in_half: 1,
            ..v1::Rays::default()
        }),
    };
    let block = Block::of_triangles(&block, triangles).ok()?;
    let tracer = Tracer::new(&block);
    Some(trace_packed(&block, || &tracer, &batch))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sample_exercises_lines_and_rays() {
        let rows = sample().unwrap();
        assert_eq!(rows.rows, 8 * 60 + 4);
        assert!(rows.segments > 1000 && rows.rays > 1000, "{rows:?}");
        assert_eq!(kernel().len(), "nestrad 0.1.0 ".len() + 16);
    }
}
