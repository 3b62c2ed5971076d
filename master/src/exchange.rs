//! The exchange matrix: batches of directions are cut into jobs, the worker's kernel computes them,
//! and their rows are put together.

use glam::DVec3;
use nestrad_common::directions::{Purpose, hemisphere, stream};
use nestrad_common::scene::Scene;
use nestrad_proto::v1;
use rand::RngExt;
use thiserror::Error;

use crate::world::World;

/// How densely the exchange is sampled.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Sampling {
    /// Independent batches of directions, an even number; the first half of them carries light one
    /// way, the second half the other way.
    pub batches: u32,
    /// Directions of parallel lines in a batch; 0 to use rays only.
    pub directions_per_batch: u32,
    /// Cross-section of a line, m².
    pub line_area_m2: f64,
    /// Samples that every face gets at least, in each half; rays from the face make up for lines.
    pub least_samples: f64,
    /// Start of all random numbers.
    pub seed: u64,
}

/// The rows of one batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchRows {
    /// Start of each row in `ends`, and its length at the end.
    pub start: Vec<u32>,
    /// What is seen, one entry per line or ray.
    pub ends: Vec<u32>,
}

impl BatchRows {
    /// What a row sees.
    #[inline]
    pub fn row(&self, row: usize) -> &[u32] {
        &self.ends[self.start[row] as usize..self.start[row + 1] as usize]
    }
}

/// All batches, and what it took to trace them.
#[derive(Clone, Debug, Default)]
pub struct Exchange {
    /// In order; the first half of them carries light one way, the second half the other way.
    pub batches: Vec<BatchRows>,
    /// Lines, segments between hits, rays.
    pub counters: Traced,
}

/// What the kernel did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Traced {
    /// Parallel lines through the scene.
    pub lines: u64,
    /// Pairs of faces that see each other along a line.
    pub segments: u64,
    /// Rays from faces.
    pub rays: u64,
    /// Entries of all rows.
    pub row_entries: u64,
}

/// Why the exchange could not be computed.
#[derive(Debug, Error)]
pub enum ExchangeError {
    /// The kernel refused a block.
    #[error("near-field job refused")]
    Block(#[from] nestrad_worker::BlockFault),
    /// A result does not fit its job.
    #[error("near-field result of batch {batch} has {found} {what}, expected {expected}")]
    Result {
        /// Number of the batch.
        batch: u32,
        /// What is wrong.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
}

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
    let mut rng = stream(sampling.seed, Purpose::Lines, u64::from(index));
    let lines = hemisphere(sampling.directions_per_batch, &mut rng)
        .into_iter()
        .map(|d| v1::Lines {
            direction: Some(vector(d)),
            random_x: rng.random(),
            random_y: rng.random(),
            random_count: rng.random(),
        })
        .collect();
    v1::Batch {
        index,
        line_area_m2: sampling.line_area_m2,
        lines,
        rays: Some(v1::Rays {
            seed: sampling.seed,
            least_samples: sampling.least_samples,
            batches_in_half: sampling.batches / 2,
        }),
    }
}

/// The part of the scene that a block of triangles needs: `owned[t]` says whether rows of triangle
/// `t` are wanted, `needed[t]` whether it may be seen from them.
pub fn block_message(scene: &Scene, world: &World, block: &BlockOf) -> v1::Block {
    let mut message = v1::Block {
        world: Some(world_message(world)),
        ..v1::Block::default()
    };
    for &(t, owned) in &block.triangles {
        let t = t as usize;
        message
            .vertices_m
            .extend(scene.triangles[t].iter().flat_map(|p| p.to_array()));
        message.first_element.push(world.elements.first[t]);
        message.divisions.push(world.elements.divisions[t]);
        message.owned.push(owned);
    }
    message.owned_soil_cells.clone_from(&block.soil_cells);
    message
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
    fn rows(&self, world: &World) -> Vec<u32> {
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

/// Traces all batches of all blocks in this process; `done` is called after each job.
pub fn trace_here(
    scene: &Scene,
    world: &World,
    blocks: &[BlockOf],
    sampling: &Sampling,
    done: impl Fn() + Sync,
) -> Result<Exchange, ExchangeError> {
    let mut exchange = Exchange::default();
    let mut of_batch: Vec<Vec<(&BlockOf, v1::Rows)>> =
        (0..sampling.batches).map(|_| Vec::new()).collect();
    for block in blocks {
        let geometry = nestrad_worker::Block::new(&block_message(scene, world, block))?;
        let tracer = nestrad_worker::Tracer::new(&geometry);
        for index in 0..sampling.batches {
            let batch = batch_message(sampling, index);
            let rows = nestrad_worker::trace(&geometry, &tracer, &batch);
            of_batch[index as usize].push((block, rows));
            done();
        }
    }
    for (index, parts) in of_batch.into_iter().enumerate() {
        for (_, rows) in &parts {
            exchange.counters.lines += rows.lines;
            exchange.counters.segments += rows.segments;
            exchange.counters.rays += rows.rays;
            exchange.counters.row_entries += rows.ends.len() as u64;
        }
        exchange
            .batches
            .push(put_together(world, index as u32, parts)?);
    }
    Ok(exchange)
}

/// Puts the rows of all blocks of a batch into the scene's order.
fn put_together(
    world: &World,
    batch: u32,
    mut parts: Vec<(&BlockOf, v1::Rows)>,
) -> Result<BatchRows, ExchangeError> {
    let rows_of: Vec<Vec<u32>> = parts.iter().map(|(block, _)| block.rows(world)).collect();
    let mut length = vec![0u32; world.rows()];
    for (numbers, (_, rows)) in rows_of.iter().zip(&parts) {
        let fault = |what, found, expected| ExchangeError::Result {
            batch,
            what,
            found,
            expected,
        };
        if rows.lengths.len() != numbers.len() {
            return Err(fault("rows", rows.lengths.len(), numbers.len()));
        }
        let entries = rows.lengths.iter().map(|&l| l as usize).sum();
        if rows.ends.len() != entries {
            return Err(fault("entries", rows.ends.len(), entries));
        }
        if let Some(&end) = rows.ends.iter().find(|&&e| e as usize >= world.ends.len()) {
            return Err(fault(
                "as the number of something seen",
                end as usize,
                world.ends.len(),
            ));
        }
        for (&row, &l) in numbers.iter().zip(&rows.lengths) {
            length[row as usize] = l;
        }
    }
    let mut start = Vec::with_capacity(length.len() + 1);
    let mut total = 0u32;
    for l in length {
        start.push(total);
        total += l;
    }
    start.push(total);
    // one block holds the scene in the scene's order
    if let [(_, rows)] = &mut parts[..] {
        return Ok(BatchRows {
            start,
            ends: std::mem::take(&mut rows.ends),
        });
    }
    let mut ends = vec![0; total as usize];
    for (numbers, (_, rows)) in rows_of.iter().zip(&parts) {
        let mut from = 0;
        for (&row, &l) in numbers.iter().zip(&rows.lengths) {
            let to = start[row as usize] as usize;
            ends[to..to + l as usize].copy_from_slice(&rows.ends[from..from + l as usize]);
            from += l as usize;
        }
    }
    Ok(BatchRows { start, ends })
}

fn vector(v: DVec3) -> v1::Vector {
    v1::Vector {
        x: v.x,
        y: v.y,
        z: v.z,
    }
}
