//! Which jobs a solve is cut into: a block, a batch, and a range of the batch's lines or its rays.
//!
//! The cut depends on the scene and on how densely it is sampled alone, so that a job that was done
//! before is known again, whoever asks and however many workers there are.

use std::ops::Range;

use nestrad_proto::v1;
use nestrad_worker::Demand;

use super::Sampling;
use super::jobs::{BlockOf, batch_message};
use crate::world::World;

/// A job is cut so that one thread computes it in about this time, seconds: long against what it costs
/// to hand it out, short against a solve; where a solve is short, shorter by up to so much, so that there
/// are about so many jobs.
const MOST_JOB_S: f64 = 0.3;
const LEAST_JOB_S: f64 = 0.02;
const JOBS: f64 = 64.0;

/// Most parts that the lattice of one direction, or the faces of a block, are cut into.
const MOST_PARTS: f64 = 64.0;

/// Seconds per triangle and direction, per segment, per lattice point, per row and job, per ray; measured
/// on maize, one thread, packing included.
const TRIANGLE_S: f64 = 40e-9;
const SEGMENT_S: f64 = 90e-9;
const LINE_S: f64 = 9e-9;
const ROW_S: f64 = 1e-9;
const RAY_S: f64 = 1e-6;

/// Seconds per triangle to build the tree that rays are cast in. Who casts the first rays over a block
/// builds it: these jobs count as large, so that they are begun early.
const TREE_S: f64 = 1.5e-6;

/// What a worker computes at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct JobOf {
    /// Index of its block.
    pub block: usize,
    /// Its batch.
    pub batch: u32,
    /// Directions of the batch.
    pub lines: Range<usize>,
    /// Which part of their lattices, of how many.
    pub part: (u32, u32),
    /// Which part of the batch's rays, of how many; `None` where it casts none.
    pub rays: Option<(u32, u32)>,
    /// What it is expected to take, seconds on one thread.
    pub cost_s: f64,
}

impl JobOf {
    /// The job as a message; `batch` is the whole of its batch.
    pub fn message(&self, batch: &v1::Batch) -> v1::Batch {
        let mut lines = batch.lines[self.lines.clone()].to_vec();
        for line in &mut lines {
            (line.part, line.parts) = self.part;
        }
        let rays = self.rays.and_then(|(part, parts)| {
            batch.rays.map(|rays| v1::Rays {
                part,
                parts,
                ..rays
            })
        });
        v1::Batch {
            index: batch.index,
            lines,
            rays,
        }
    }
}

/// The jobs of all blocks and batches: by batch, then by block.
pub fn split(
    world: &World,
    blocks: &[BlockOf],
    batches: &[v1::Batch],
    sampling: &Sampling,
) -> Vec<JobOf> {
    let sizes: Vec<Sizes> = blocks
        .iter()
        .map(|block| Sizes::of(world, block, sampling))
        .collect();
    let all_s: f64 = batches
        .iter()
        .flat_map(|batch| sizes.iter().map(|sizes| sizes.batch_s(batch, world)))
        .sum();
    let job_s = (all_s / JOBS).clamp(LEAST_JOB_S, MOST_JOB_S);
    let mut jobs = Vec::new();
    for batch in batches {
        for (block, sizes) in sizes.iter().enumerate() {
            sizes.split((block, batch), world, job_s, &mut jobs);
        }
    }
    jobs
}

/// All batches of a sampling, whole.
pub fn batches(sampling: &Sampling) -> Vec<v1::Batch> {
    (0..sampling.batches)
        .map(|index| batch_message(sampling, index))
        .collect()
}

/// What a block needs of a worker.
pub fn demand(world: &World, block: &BlockOf, sampling: &Sampling) -> Demand {
    let sizes = Sizes::of(world, block, sampling);
    let direction_s = sizes.direction_s(world, sampling.line_area_m2, 1.0);
    // a job of one direction in its parts, or of as many directions as fill its time
    let most = f64::from(sampling.sets_per_batch * sampling.axes.count()).max(1.0);
    let directions = (MOST_JOB_S / direction_s).clamp(1.0 / MOST_PARTS, most);
    let entries = 2.0 * sizes.segments(world, sampling.line_area_m2, 1.0) * directions;
    let entries = entries.max(MOST_JOB_S / RAY_S) as u64;
    Demand {
        entries,
        ..sizes.demand
    }
}

/// What the cost of a block's jobs depends on.
struct Sizes {
    demand: Demand,
    area_m2: f64,
    /// Rays of a batch.
    rays: f64,
}

impl Sizes {
    fn of(world: &World, block: &BlockOf, sampling: &Sampling) -> Self {
        let elements = &world.elements;
        let missing = |area_m2: f64| {
            let missing = sampling.least_samples - area_m2 * sampling.lines_per_m2();
            missing.max(0.0).ceil() / f64::from((sampling.batches / 2).max(1))
        };
        let mut demand = Demand {
            triangles: block.triangles.len() as u64,
            other_ends: (world.ends.len() - world.ends.faces() as usize) as u64,
            rows: block.soil_cells.len() as u64,
            ..Demand::default()
        };
        let soil_area_m2 = world.soil.map_or(0.0, |s| s.cell_area_m2());
        let (mut area_m2, mut rays) = (0.0, missing(soil_area_m2) * demand.rows as f64);
        for &(t, owned) in &block.triangles {
            let pieces = elements.divisions[t as usize].pow(2);
            let piece_m2 = elements.area_m2[elements.first[t as usize] as usize];
            area_m2 += piece_m2 * f64::from(pieces);
            demand.elements += u64::from(pieces);
            if owned {
                demand.rows += 2 * u64::from(pieces);
                rays += 2.0 * f64::from(pieces) * missing(piece_m2);
            }
        }
        Self {
            demand,
            area_m2,
            rays,
        }
    }

    /// Segments of a direction: each face that a line meets begins one, and so does each line.
    fn segments(&self, world: &World, line_area_m2: f64, cos: f64) -> f64 {
        (0.5 * self.area_m2 + cos * world.ground_area_m2()) / line_area_m2
    }

    fn direction_s(&self, world: &World, line_area_m2: f64, cos: f64) -> f64 {
        TRIANGLE_S * self.demand.triangles as f64
            + SEGMENT_S * 0.5 * self.area_m2 / line_area_m2
            + LINE_S * cos * world.ground_area_m2() / line_area_m2
    }

    fn lines_s(&self, lines: &v1::Lines, world: &World) -> f64 {
        let cos = lines.direction.as_ref().map_or(1.0, |d| d.z);
        self.direction_s(world, lines.line_area_m2, cos)
    }

    /// What a batch of the block takes in all.
    fn batch_s(&self, batch: &v1::Batch, world: &World) -> f64 {
        let lines_s: f64 = batch.lines.iter().map(|l| self.lines_s(l, world)).sum();
        lines_s + batch.rays.map_or(0.0, |_| RAY_S * self.rays)
    }

    /// Cuts a batch of a block into jobs.
    fn split(
        &self,
        (block, batch): (usize, &v1::Batch),
        world: &World,
        job_s: f64,
        jobs: &mut Vec<JobOf>,
    ) {
        let rows_s = ROW_S * self.demand.rows as f64;
        let job = |lines: Range<usize>, part, rays, cost_s: f64| JobOf {
            block,
            batch: batch.index,
            lines,
            part,
            rays,
            cost_s: cost_s + rows_s,
        };
        let (mut first, mut cost_s) = (0, 0.0);
        for (k, lines) in batch.lines.iter().enumerate() {
            let this_s = self.lines_s(lines, world);
            let parts = (this_s / job_s).round().clamp(1.0, MOST_PARTS) as u32;
            if cost_s > 0.0 && (cost_s + this_s > job_s || parts > 1) {
                jobs.push(job(first..k, (0, 1), None, cost_s));
                (first, cost_s) = (k, 0.0);
            }
            if parts > 1 {
                let part = |p| job(k..k + 1, (p, parts), None, this_s / f64::from(parts));
                jobs.extend((0..parts).map(part));
                first = k + 1;
            } else {
                cost_s += this_s;
            }
        }
        // the rays of a batch come after its lines
        let rays_s = RAY_S * self.rays;
        let rest = first..batch.lines.len();
        if batch.rays.is_none() || cost_s + rays_s <= job_s {
            let rays = batch.rays.map(|_| (0, 1));
            if rays.is_some() || !rest.is_empty() {
                let tree_s = rays.map_or(0.0, |_| TREE_S * self.demand.triangles as f64);
                jobs.push(job(rest, (0, 1), rays, cost_s + rays_s + tree_s));
            }
            return;
        }
        if !rest.is_empty() {
            jobs.push(job(rest, (0, 1), None, cost_s));
        }
        let parts = (rays_s / job_s).ceil().clamp(1.0, MOST_PARTS) as u32;
        let end = batch.lines.len();
        let part_s = rays_s / f64::from(parts) + TREE_S * self.demand.triangles as f64;
        let part = |p| job(end..end, (0, 1), Some((p, parts)), part_s);
        jobs.extend((0..parts).map(part));
    }
}
