//! Jobs as messages: the world, a block of geometry, a batch of directions.

use glam::DVec3;
use nestrad_common::directions::{Axes, Purpose, axes, stream};
use nestrad_proto::v1;
use rand::RngExt;

use super::Sampling;
use crate::world::World;

/// The world as jobs carry it.
pub fn world_message(world: &World) -> v1::World {
    v1::World {
        min_m: Some(vector(world.extent.min_m)),
        max_m: Some(vector(world.extent.max_m)),
        periodic: world.extent.periodic,
        elements: world.ends.elements,
        soil: world.soil.map(|s| v1::SoilPlane {
            z_m: s.z_m,
            min_x_m: s.min_m.x,
            min_y_m: s.min_m.y,
            cell_x_m: s.cell_m.x,
            cell_y_m: s.cell_m.y,
            cells_x: s.nx,
            cells_y: s.ny,
        }),
        sphere_radius_m: world.radius_m,
        far_levels: world.ends.far_levels,
        far_bins: world.ends.far_bins,
    }
}

/// A batch: its directions and everything random in it.
pub fn batch_message(sampling: &Sampling, index: u32) -> v1::Batch {
    let numbers = (sampling.seed, Purpose::Lines, u64::from(index));
    v1::Batch {
        index,
        rays: Some(v1::Rays {
            seed: sampling.seed,
            least_samples: sampling.least_samples,
            batches_in_half: sampling.batches / 2,
            lines_per_m2: sampling.lines_per_m2(),
            ..v1::Rays::default()
        }),
        ..batch_of_lines(
            numbers,
            (sampling.axes, sampling.sets_per_batch),
            sampling.line_area_m2,
        )
    }
}

/// Lines along sets of axes. `numbers` says which random numbers: seed, purpose and index.
pub fn batch_of_lines(
    numbers: (u64, Purpose, u64),
    (kind, sets): (Axes, u32),
    line_area_m2: f64,
) -> v1::Batch {
    let mut rng = stream(numbers.0, numbers.1, numbers.2);
    let lines = axes(kind, sets, &mut rng)
        .into_iter()
        .map(|axis| v1::Lines {
            direction: Some(vector(axis.direction)),
            random_x: rng.random(),
            random_y: rng.random(),
            random_count: rng.random(),
            // every line weighs the same: a direction of larger weight has more of them
            line_area_m2: line_area_m2 / axis.weight,
            ..v1::Lines::default()
        })
        .collect();
    v1::Batch {
        lines,
        ..v1::Batch::default()
    }
}

/// Which triangles and soil cells a block holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockOf {
    /// Number in the scene, and whether rows of it are wanted; by rising number.
    pub triangles: Vec<(u32, bool)>,
    /// Soil cells whose rows are wanted, rising.
    pub soil_cells: Vec<u32>,
}

impl BlockOf {
    /// The whole scene as one block.
    pub fn whole(world: &World) -> Self {
        Self {
            triangles: (0..world.elements.divisions.len() as u32)
                .map(|t| (t, true))
                .collect(),
            soil_cells: (0..world.ends.soil_cells).collect(),
        }
    }

    /// The rows of the scene that the block's rows are, in order.
    pub(super) fn rows(&self, world: &World) -> Vec<u32> {
        let mut rows = Vec::new();
        for &(t, owned) in &self.triangles {
            if owned {
                let elements =
                    world.elements.first[t as usize]..world.elements.first[t as usize + 1];
                rows.extend(2 * elements.start..2 * elements.end);
            }
        }
        rows.extend(self.soil_cells.iter().map(|&c| world.ends.soil(c)));
        rows
    }
}

fn vector(v: DVec3) -> v1::Vector {
    v1::Vector {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}
