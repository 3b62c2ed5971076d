//! The exchange matrix: batches of directions are cut into jobs, the worker's kernel computes them,
//! and their rows are put together.

mod assembly;
mod geometry;
mod jobs;
mod join;
mod kept;
mod outlook;
mod partition;
mod rows;
mod split;

use std::ops::AddAssign;

use glam::DVec3;
use nestrad_common::directions::Axes;
use nestrad_common::lattice::{Extent, Lattice};
use nestrad_common::scene::Scene;
use nestrad_proto::packed::PackedFault;
use nestrad_proto::v1;
use thiserror::Error;

use crate::output::progress::Cancelled;
use crate::world::World;
pub use assembly::{Assembly, JobRows};
pub(crate) use geometry::unbounded_block_here;
pub use geometry::{block_here, block_message};
pub use jobs::{BlockOf, batch_message, batch_of_lines, world_message};
pub use kept::trace_kept;
pub use outlook::Outlook;
pub use partition::{SmallestWorker, partition};
use rows::put_together;
pub use rows::{BatchRows, HalfRows};
pub use split::{JobOf, batches, demand, split};

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

    /// A batch of each half alone, of few sets, without rays for what it meets too thinly: enough to compare two
    /// models by the same lines.
    pub fn glance(&self) -> Self {
        Self {
            batches: 2,
            sets_per_batch: self.sets_per_batch.min(MOST_SETS_AT_A_GLANCE),
            least_samples: if self.sets_per_batch > 0 {
                0.0
            } else {
                RAYS_AT_A_GLANCE
            },
            ..*self
        }
    }

    /// Lines through an extent, in all directions together.
    pub fn lines(&self, extent: &Extent) -> f64 {
        let lattice = |lines: v1::Lines| {
            let d = lines.direction.unwrap_or_default();
            let random = [lines.random_x, lines.random_y, lines.random_count];
            Lattice::new(
                DVec3::new(d.x, d.y, d.z),
                extent,
                lines.line_area_m2,
                random,
            )
            .lines()
        };
        (0..self.batches)
            .flat_map(|b| batch_message(self, b).lines)
            .map(|lines| lattice(lines) as f64)
            .sum()
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

const MOST_SETS_AT_A_GLANCE: u32 = 8;
/// From each face in each half, where there are no lines.
const RAYS_AT_A_GLANCE: f64 = 8.0;

/// All batches, and what it took to trace them.
#[derive(Clone, Debug, Default)]
pub struct Exchange {
    /// The first half of the batches carries light one way, the second half the other way.
    pub halves: [HalfRows; 2],
    /// Lines, segments between hits, rays.
    pub counters: Traced,
    /// Jobs that it took.
    pub jobs: JobCounts,
}

/// Jobs by where their results come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct JobCounts {
    /// Traced for this solve.
    pub traced: u64,
    /// Kept from an earlier one.
    pub kept: u64,
}

impl Exchange {
    /// Joins all batches.
    fn of_batches(mut batches: Vec<BatchRows>, counters: Traced, jobs: JobCounts) -> Self {
        let mut halves = [HalfRows::default(), HalfRows::default()];
        // each half's batches are freed before the other half is joined
        let second = batches.split_off(batches.len() / 2);
        halves[0] = HalfRows::join(&batches);
        drop(batches);
        halves[1] = HalfRows::join(&second);
        Self {
            halves,
            counters,
            jobs,
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

impl AddAssign for Traced {
    fn add_assign(&mut self, more: Self) {
        self.lines += more.lines;
        self.segments += more.segments;
        self.rays += more.rays;
        self.row_entries += more.row_entries;
    }
}

/// Why the exchange could not be computed.
#[derive(Debug, Error)]
pub enum ExchangeError {
    /// The kernel refused a block.
    #[error("near-field job refused")]
    Block(#[from] nestrad_worker::BlockFault),
    /// The workers could not do it.
    #[error("{0}")]
    Failed(String),
    /// Packed rows cannot be read.
    #[error("near-field result cannot be read")]
    Packed(#[from] PackedFault),
    /// No cut of the scene into blocks is small enough for a worker.
    #[error(
        "a worker needs {needed_GiB:.2} GiB for the smallest block of this scene, the smallest has \
         {limit_GiB:.2}: give workers more memory{}", if *.bounded { "" } else { " or choose a --diameter" }
    )]
    BlockTooLarge {
        /// What the smallest block that was tried takes.
        needed_GiB: f64,
        /// What a worker may take.
        limit_GiB: f64,
        /// Whether the near field has a bound.
        bounded: bool,
    },
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
    let mut of_batch: Vec<Vec<(&BlockOf, v1::Rows)>> =
        (0..sampling.batches).map(|_| Vec::new()).collect();
    for block in blocks {
        let geometry = block_here(scene, world, block)?;
        let tracer = nestrad_worker::Tracer::new(&geometry);
        for index in 0..sampling.batches {
            let batch = batch_message(sampling, index);
            let rows = nestrad_worker::trace(&geometry, &tracer, &batch);
            of_batch[index as usize].push((block, rows));
            done()?;
        }
    }
    let mut counters = Traced::default();
    let mut batches = Vec::with_capacity(of_batch.len());
    for (index, parts) in of_batch.into_iter().enumerate() {
        for (_, rows) in &parts {
            counters += Traced {
                lines: rows.lines,
                segments: rows.segments,
                rays: rows.rays,
                row_entries: rows.ends.len() as u64,
            };
        }
        batches.push(put_together(world, index as u32, parts)?);
    }
    let jobs = JobCounts {
        traced: u64::from(sampling.batches) * blocks.len() as u64,
        kept: 0,
    };
    Ok(Exchange::of_batches(batches, counters, jobs))
}
