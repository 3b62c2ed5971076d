//! The exchange matrix: batches of directions are cut into jobs, the worker's kernel computes them,
//! and their rows are put together.

mod jobs;
mod outlook;
mod rows;

use nestrad_common::directions::Axes;
use nestrad_common::scene::Scene;
use nestrad_proto::v1;
use thiserror::Error;

use crate::output::progress::Cancelled;
use crate::world::World;
pub use jobs::{BlockOf, batch_message, batch_of_lines, block_message, world_message};
pub use outlook::Outlook;
use rows::put_together;
pub use rows::{BatchRows, HalfRows};

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

/// All batches, and what it took to trace them.
#[derive(Clone, Debug, Default)]
pub struct Exchange {
    /// The first half of the batches carries light one way, the second half the other way.
    pub halves: [HalfRows; 2],
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
    /// It is not wanted any more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Traces all batches of all blocks in this process; `done` is called after each job, and may end it.
pub fn trace_here(
    scene: &Scene,
    world: &World,
    blocks: &[BlockOf],
    sampling: &Sampling,
    done: impl Fn() -> Result<(), Cancelled>,
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
            done()?;
        }
    }
    let mut batches = Vec::with_capacity(of_batch.len());
    for (index, parts) in of_batch.into_iter().enumerate() {
        for (_, rows) in &parts {
            exchange.counters.lines += rows.lines;
            exchange.counters.segments += rows.segments;
            exchange.counters.rays += rows.rays;
            exchange.counters.row_entries += rows.ends.len() as u64;
        }
        batches.push(put_together(world, index as u32, parts)?);
    }
    // each half's batches are freed before the other half is joined
    let second = batches.split_off(batches.len() / 2);
    exchange.halves[0] = HalfRows::join(&batches);
    drop(batches);
    exchange.halves[1] = HalfRows::join(&second);
    Ok(exchange)
}
