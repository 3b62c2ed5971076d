//! The exchange matrix: batches of directions are cut into jobs, the worker's kernel computes them,
//! and their rows are put together.

use glam::DVec3;
use nestrad_common::directions::{Axes, Purpose, axes, stream};
use nestrad_common::scene::Scene;
use nestrad_proto::v1;
use rand::RngExt;
use rayon::prelude::*;
use thiserror::Error;

use crate::world::World;

/// How densely the exchange is sampled.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Sampling {
    /// Independent batches of directions, an even number; the first half of them carries light one
    /// way, the second half the other way.
    pub batches: u32,
    /// Axes of parallel lines that make a set.
    pub axes: Axes,
    /// Sets of axes in a batch; 0 to use rays only.
    pub sets_per_batch: u32,
    /// Cross-section of a line, m².
    pub line_area_m2: f64,
    /// Samples that every face gets at least, in each half; rays from the face make up for lines.
    pub least_samples: f64,
    /// Start of all random numbers.
    pub seed: u64,
}

impl Sampling {
    /// Lines of a half that meet a square metre of leaf, on average over its inclination: they see
    /// |cos| of its area, whose mean over the hemisphere is 1/2.
    pub fn lines_per_m2(&self) -> f64 {
        let directions = self.batches / 2 * self.sets_per_batch * self.axes.count();
        0.5 * f64::from(directions) / self.line_area_m2
    }

    /// The longest line through a layer of that height, metres; infinite with rays.
    pub fn longest_sight_m(&self, height_m: f64) -> f64 {
        (0..self.batches)
            .flat_map(|b| batch_message(self, b).lines)
            .filter_map(|l| l.direction)
            .map(|d| height_m / d.z)
            .fold(
                if self.sets_per_batch == 0 {
                    f64::INFINITY
                } else {
                    0.0
                },
                f64::max,
            )
    }
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
    /// Rows of these lengths.
    pub fn new(lengths: &[u32], ends: Vec<u32>) -> Self {
        let mut start = Vec::with_capacity(lengths.len() + 1);
        let mut total = 0;
        start.push(0);
        for l in lengths {
            total += l;
            start.push(total);
        }
        Self { start, ends }
    }

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

/// What the rows see that is not a radiosity to solve for.
#[derive(Clone, Debug, Default)]
pub struct Outlook {
    /// One over the number of lines of a row that count, in each half; 0 for a row without.
    pub weight: [Vec<f64>; 2],
    /// The part of each row that is not buried in something solid.
    pub exposed: Vec<f64>,
    /// The part of what each row sends out that leaves to the sky, by the lines of each half.
    pub to_sky: [Vec<f64>; 2],
    /// The part that leaves downwards, or to the soil beyond the map.
    pub to_void: [Vec<f64>; 2],
    /// The part of what each row sees that is soil beyond the map of an open scene.
    pub outer_soil: Vec<f64>,
}

impl Exchange {
    /// Counts what is seen by each row.
    pub fn outlook(&self, world: &World) -> Outlook {
        let half = self.batches.len() / 2;
        let seen: Vec<[Seen; 2]> = (0..world.rows())
            .into_par_iter()
            .map(|row| {
                let mut seen = [Seen::default(); 2];
                for (k, batch) in self.batches.iter().enumerate() {
                    seen[usize::from(k >= half)].count(world, batch.row(row));
                }
                seen
            })
            .collect();
        let per = |part: usize, of: usize| {
            if of == 0 {
                0.0
            } else {
                part as f64 / of as f64
            }
        };
        let exposed = |[a, b]: &[Seen; 2]| match (a.counted + b.counted, a.buried + b.buried) {
            (_, 0) => 1.0,
            (counted, buried) => per(counted, counted + buried),
        };
        // a row without lines in a half is judged by those of the other
        let part = |of: fn(&Seen) -> usize| {
            [0, 1].map(|h: usize| {
                let judge = |s: &[Seen; 2]| if s[h].counted > 0 { s[h] } else { s[1 - h] };
                seen.iter()
                    .map(|s| per(of(&judge(s)), judge(s).counted))
                    .collect::<Vec<f64>>()
            })
        };
        Outlook {
            weight: [0, 1].map(|h: usize| seen.iter().map(|s| per(1, s[h].counted)).collect()),
            exposed: seen.iter().map(exposed).collect(),
            to_sky: part(|s| s.sky),
            to_void: part(|s| s.void),
            outer_soil: seen
                .iter()
                .map(|[a, b]| per(a.outer + b.outer, a.counted + b.counted))
                .collect(),
        }
    }
}

/// Lines of a row in one half, by what they see.
#[derive(Clone, Copy, Default)]
struct Seen {
    /// All that are not buried.
    counted: usize,
    buried: usize,
    sky: usize,
    void: usize,
    outer: usize,
}

impl Seen {
    fn count(&mut self, world: &World, row: &[u32]) {
        let ends = &world.ends;
        for &end in row {
            let buried = end == ends.buried();
            self.buried += usize::from(buried);
            self.counted += usize::from(!buried);
            self.sky += usize::from(end == ends.sky());
            let outer = end == ends.outer_soil();
            self.outer += usize::from(outer);
            self.void += usize::from(outer || end == ends.void());
        }
    }
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
    let numbers = (sampling.seed, Purpose::Lines, u64::from(index));
    v1::Batch {
        index,
        rays: Some(v1::Rays {
            seed: sampling.seed,
            least_samples: sampling.least_samples,
            batches_in_half: sampling.batches / 2,
            lines_per_m2: sampling.lines_per_m2(),
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
        })
        .collect();
    v1::Batch {
        lines,
        ..v1::Batch::default()
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
        message.solid.push(world.solid[t]);
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
