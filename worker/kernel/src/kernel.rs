//! A name for the bits that this kernel computes.

use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};

use crate::block::{BlockFrame, CellRun, TriangleRun};
use crate::far_grid::{Levels, SharedFarGrid};
use crate::job::{Batch, Lines, Rays};
use crate::lattice::Extent;
use crate::part::Part;
use crate::soil::SoilGrid;
use crate::world::World;
use crate::{Block, PackedRows, Tracer, trace};

/// Names the results of this kernel on this machine: the same name, the same bits. It holds a digest of
/// the packed rows of two small jobs, so that a change of the kernel or of the format, or a machine whose sine differs in the last
/// bit, has another name.
pub fn kernel() -> &'static str {
    static NAME: OnceLock<String> = OnceLock::new();
    NAME.get_or_init(|| {
        let mut hasher = blake3::Hasher::new();
        for periodic in [true, false] {
            hasher.update(&sample(periodic).unwrap_or_default().packed);
        }
        let digest = hasher.finalize().to_hex();
        format!("nestrad {} {}", env!("CARGO_PKG_VERSION"), &digest[..16])
    })
}

/// Leaves and stems at odd places, over soil; lines and rays. With a pattern, there is a far field.
fn sample(periodic: bool) -> Option<PackedRows> {
    let mut state = 1u64;
    let mut random = || {
        // Knuth's MMIX generator: any will do
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    const TRIANGLES: usize = 60;
    let mut triangles = Vec::with_capacity(TRIANGLES);
    for _ in 0..TRIANGLES {
        let middle = [random(), random(), 0.1 + 0.8 * random()];
        let mut corner = || middle.map(|m| m + 0.3 * (random() - 0.5));
        triangles.push([corner(), corner(), corner()].map(DVec3::from_array));
    }
    let run = |solid| TriangleRun {
        triangles: 1,
        skipped_elements: 0,
        divisions: 2,
        owned: true,
        solid,
    };
    let far = Some(Arc::new(Levels { levels: 5, bins: 3 }) as SharedFarGrid);
    let frame = BlockFrame {
        world: World {
            extent: Extent {
                min_m: DVec3::new(0.0, 0.0, -0.1),
                max_m: DVec3::new(1.0, 1.0, 1.1),
                periodic,
            },
            elements: 4 * TRIANGLES as u32,
            soil: Some(SoilGrid {
                z_m: -0.1,
                min_m: DVec2::ZERO,
                cell_m: DVec2::splat(0.5),
                cells: [2, 2],
            }),
            radius_m: if periodic { 0.4 } else { f64::INFINITY },
            far: far.filter(|_| periodic),
        },
        runs: (0..TRIANGLES).map(|t| run(t % 3 == 0)).collect(),
        owned_soil: vec![CellRun {
            cells: 4,
            skipped_cells: 0,
        }],
    };
    let lines = (0..8).map(|k| {
        let (sin, cos) = (0.3 + 0.7 * f64::from(k)).sin_cos();
        let z: f64 = 0.1 + 0.1 * f64::from(k);
        let r = (1.0 - z * z).sqrt();
        Lines {
            direction: DVec3::new(r * cos, r * sin, z),
            random: [random(), random(), random()],
            line_area_m2: 0.001,
            part: Part::default(),
        }
    });
    let batch = Batch {
        index: 1,
        lines: lines.collect(),
        rays: Some(Rays {
            seed: 7,
            least_samples: 8.0,
            batches_in_half: 1,
            lines_per_m2: 0.0,
            in_a_row_m: f64::INFINITY,
            part: Part::default(),
        }),
    };
    let block = Block::new(&frame, Arc::new(triangles.into_iter().collect())).ok()?;
    let tracer = Tracer::new(&block);
    Some(trace(&block, || &tracer, &batch).packed(&block))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sample_exercises_lines_and_rays() {
        for periodic in [true, false] {
            let rows = sample(periodic).unwrap();
            let counts = rows.counts;
            assert!(counts.segments > 1000 && counts.rays > 1000, "{rows:?}");
        }
        assert_eq!(kernel().len(), "nestrad 0.1.0 ".len() + 16);
    }
}
