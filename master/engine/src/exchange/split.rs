//! Which jobs a solve is cut into: a block, a batch, and a range of the batch's lines or its rays.
//!
//! The cut depends on the scene and on how densely it is sampled alone, so that a job that was done
//! before is known again, whoever asks and however many workers there are.

use std::ops::Range;

use nestrad_kernel::Demand;
use nestrad_kernel::cost::{DRAWN_NS, LINE_NS, RAY_NS, ROW_NS, SEGMENT_NS, TREE_NS};
use nestrad_kernel::job::{Batch, Lines, Rays};
use nestrad_kernel::part::Part;

use super::blocks::BlockOf;
use super::sampling::Sampling;
use crate::frame::Frame;

/// A job is cut so that one thread computes it in about this time, seconds: long against what it costs
/// to hand it out, short against a solve; where a solve is short, shorter by up to so much, so that there
/// are about so many jobs.
const MOST_JOB_S: f64 = 0.3;
const LEAST_JOB_S: f64 = 0.02;
const JOBS: f64 = 64.0;

/// Most parts that the lattice of one direction, or the faces of a block, are cut into.
const MOST_PARTS: f64 = 64.0;

/// What a worker computes at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct JobOf {
    /// Index of its block.
    pub block: usize,
    /// Its batch.
    pub batch: u32,
    /// Directions of the batch.
    pub lines: Range<usize>,
    /// Which part of their lattices.
    pub part: Part,
    /// Which part of the batch's rays; `None` where it casts none.
    pub rays: Option<Part>,
    /// What it is expected to take, seconds on one thread.
    pub cost_s: f64,
}

impl JobOf {
    /// A whole batch of the first block.
    pub(super) fn whole(batch: &Batch) -> Self {
        Self {
            block: 0,
            batch: batch.index,
            lines: 0..batch.lines.len(),
            part: Part::default(),
            rays: batch.rays.map(|rays| rays.part),
            cost_s: 0.0,
        }
    }

    /// What it has of its batch.
    pub(super) fn of_batch(&self, batch: &Batch) -> Batch {
        let part = |lines: &Lines| Lines {
            part: self.part,
            ..*lines
        };
        let rays = self.rays.zip(batch.rays);
        Batch {
            index: batch.index,
            lines: batch.lines[self.lines.clone()].iter().map(part).collect(),
            rays: rays.map(|(part, rays)| Rays { part, ..rays }),
        }
    }
}

/// The jobs of all blocks and batches: by batch, then by block.
pub(super) fn split(
    frame: &Frame,
    blocks: &[BlockOf],
    batches: &[Batch],
    sampling: &Sampling,
) -> Vec<JobOf> {
    let sizes: Vec<Sizes> = blocks
        .iter()
        .map(|block| Sizes::of(frame, block, sampling))
        .collect();
    let all_s: f64 = batches
        .iter()
        .flat_map(|batch| sizes.iter().map(|sizes| sizes.batch_s(batch, frame)))
        .sum();
    let job_s = (all_s / JOBS).clamp(LEAST_JOB_S, MOST_JOB_S);
    let mut jobs = Vec::new();
    for batch in batches {
        for (block, sizes) in sizes.iter().enumerate() {
            sizes.split((block, batch), frame, job_s, &mut jobs);
        }
    }
    jobs
}

/// What a block needs of a worker.
pub fn demand(frame: &Frame, block: &BlockOf, sampling: &Sampling) -> Demand {
    let sizes = Sizes::of(frame, block, sampling);
    let direction_s = sizes.direction_s(frame, sampling.line_area_m2, 1.0);
    // a job of one direction in its parts, or of as many directions as fill its time
    let most = f64::from(sampling.sets_per_batch * sampling.axes.count()).max(1.0);
    let directions = (MOST_JOB_S / direction_s).clamp(1.0 / MOST_PARTS, most);
    let entries = 2.0 * sizes.segments(frame, sampling.line_area_m2, 1.0) * directions;
    let entries = entries.max(MOST_JOB_S / (1e-9 * RAY_NS)) as u64;
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
    fn of(frame: &Frame, block: &BlockOf, sampling: &Sampling) -> Self {
        let elements = frame.elements();
        let missing = |area_m2: f64| {
            let missing = sampling.least_samples - area_m2 * sampling.lines_per_m2();
            missing.max(0.0).ceil() / f64::from((sampling.batches / 2).max(1))
        };
        let mut demand = Demand {
            triangles: block.triangles.len() as u64,
            other_ends: (frame.ends.len() - frame.ends.faces() as usize) as u64,
            rows: block.soil_cells.len() as u64,
            ..Demand::default()
        };
        let soil_area_m2 = frame.world.soil.map_or(0.0, |s| s.cell_area_m2());
        let (mut area_m2, mut rays) = (0.0, missing(soil_area_m2) * demand.rows as f64);
        for &(t, owned) in &block.triangles {
            let pieces = elements.divisions[t as usize].pow(2);
            let piece_m2 = frame.area_m2[elements.first[t as usize] as usize];
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
    fn segments(&self, frame: &Frame, line_area_m2: f64, cos: f64) -> f64 {
        (0.5 * self.area_m2 + cos * frame.world.ground_area_m2()) / line_area_m2
    }

    fn direction_s(&self, frame: &Frame, line_area_m2: f64, cos: f64) -> f64 {
        let triangles = DRAWN_NS * self.demand.triangles as f64;
        let segments = SEGMENT_NS * 0.5 * self.area_m2 / line_area_m2;
        let lines = LINE_NS * cos * frame.world.ground_area_m2() / line_area_m2;
        1e-9 * (triangles + segments + lines)
    }

    fn lines_s(&self, lines: &Lines, frame: &Frame) -> f64 {
        self.direction_s(frame, lines.line_area_m2, lines.direction.z)
    }

    /// What a batch of the block takes in all.
    fn batch_s(&self, batch: &Batch, frame: &Frame) -> f64 {
        let lines_s: f64 = batch.lines.iter().map(|l| self.lines_s(l, frame)).sum();
        lines_s + batch.rays.map_or(0.0, |_| self.rays_s())
    }

    fn rays_s(&self) -> f64 {
        1e-9 * RAY_NS * self.rays
    }

    /// Who casts the first rays over a block builds its tree: these jobs count as large, so that they are begun
    /// early.
    fn tree_s(&self) -> f64 {
        1e-9 * TREE_NS * self.demand.triangles as f64
    }

    /// Cuts a batch of a block into jobs.
    fn split(
        &self,
        (block, batch): (usize, &Batch),
        frame: &Frame,
        job_s: f64,
        jobs: &mut Vec<JobOf>,
    ) {
        let rows_s = 1e-9 * ROW_NS * self.demand.rows as f64;
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
            let this_s = self.lines_s(lines, frame);
            let parts = (this_s / job_s).round().clamp(1.0, MOST_PARTS) as u32;
            if cost_s > 0.0 && (cost_s + this_s > job_s || parts > 1) {
                jobs.push(job(first..k, Part::default(), None, cost_s));
                (first, cost_s) = (k, 0.0);
            }
            if parts > 1 {
                let part = |p| {
                    job(
                        k..k + 1,
                        Part::new(p, parts),
                        None,
                        this_s / f64::from(parts),
                    )
                };
                jobs.extend((0..parts).map(part));
                first = k + 1;
            } else {
                cost_s += this_s;
            }
        }
        // the rays of a batch come after its lines
        let rays_s = self.rays_s();
        let rest = first..batch.lines.len();
        if batch.rays.is_none() || cost_s + rays_s <= job_s {
            let rays = batch.rays.map(|_| Part::default());
            if rays.is_some() || !rest.is_empty() {
                let tree_s = rays.map_or(0.0, |_| self.tree_s());
                jobs.push(job(rest, Part::default(), rays, cost_s + rays_s + tree_s));
            }
            return;
        }
        if !rest.is_empty() {
            jobs.push(job(rest, Part::default(), None, cost_s));
        }
        let parts = (rays_s / job_s).ceil().clamp(1.0, MOST_PARTS) as u32;
        let end = batch.lines.len();
        let part_s = rays_s / f64::from(parts) + self.tree_s();
        let part = |p| job(end..end, Part::default(), Some(Part::new(p, parts)), part_s);
        jobs.extend((0..parts).map(part));
    }
}
