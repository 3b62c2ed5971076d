//! Rays from the faces themselves: they complete the faces that the lines sample too thinly, and over
//! all faces they are the independent estimator that the lines are tested against.

mod boxes;
mod meeting;
#[cfg(test)]
mod tests;
mod tracer;
mod tree;

use std::ops::Range;

use glam::{DVec2, DVec3};
use nestrad_common::geometry;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

use crate::above::Above;
use crate::block::Block;
use crate::directions::{Purpose, stream};
use crate::elements;
use crate::job::{Batch, Rays};
use crate::owned::Owned;
use crate::rows::{Pair, Seen};
use crate::soil::SoilGrid;
pub use tracer::Tracer;
use tree::FaceRay;

/// Triangles whose rays are cast as one task.
const TASK: usize = 256;

/// Adds what rays see to what lines saw.
pub(crate) fn complete(block: &Block, tracer: &Tracer, batch: &Batch, seen: &mut Seen) {
    let Some(rays) = &batch.rays else { return };
    let share = Share::of(rays, batch);
    let part = rays.part;
    let triangles = part.of(block.soup.len());
    let tasks = triangles.len().div_ceil(TASK);
    let looks: Vec<Vec<Pair>> = (0..tasks)
        .into_par_iter()
        .map(|task| {
            let mut looks = Vec::new();
            let first = triangles.start + task * TASK;
            for t in first..(first + TASK).min(triangles.end) {
                from_triangle(block, tracer, &share, t, &mut looks);
            }
            looks
        })
        .collect();
    seen.looks = looks.concat();
    let cells = part.of(block.ends.soil_cells as usize);
    from_soil(block, tracer, &share, cells, &mut seen.looks);
    seen.rays = seen.looks.len() as u64;
}

/// How many rays this batch has to cast, and which.
struct Share<'a> {
    rays: &'a Rays,
    batch: u32,
}

impl<'a> Share<'a> {
    fn of(rays: &'a Rays, batch: &Batch) -> Self {
        Self {
            rays,
            batch: batch.index,
        }
    }

    /// Rays from a cell of the soil.
    fn of_cell(&self, soil: &SoilGrid, end: u32) -> u32 {
        self.rays_of(soil.cell_area_m2(), soil.cell_m.max_element(), end)
    }

    /// Rays in this batch for a face of that area and that longest edge: those of the half are dealt out in
    /// turn.
    fn rays_of(&self, area_m2: f64, longest_m: f64, face: u32) -> u32 {
        let missing = self.rays.of_half(area_m2, longest_m);
        let batches = self.rays.batches_in_half.max(1);
        let turn = (self.batch % batches + face % batches) % batches;
        missing / batches + u32::from(turn < missing % batches)
    }

    /// Random numbers of an end, which depend on nothing else.
    fn numbers(&self, end: u32) -> Pcg64Mcg {
        stream(
            self.rays.seed,
            Purpose::Rays,
            u64::from(self.batch) << 32 | u64::from(end),
        )
    }
}

/// Of the elements of a triangle.
struct Size {
    element_m2: f64,
    longest_m: f64,
}

impl Size {
    fn of(triangle: &[DVec3; 3], divisions: u32) -> Self {
        Self {
            element_m2: geometry::area(triangle) / f64::from(divisions * divisions),
            longest_m: geometry::longest_edge(triangle) / f64::from(divisions),
        }
    }

    /// Of an element, as far as it stands above the soil.
    fn above_m2(&self, above: &Above) -> f64 {
        match above {
            Above::Part(part) => part.share * self.element_m2,
            Above::Whole | Above::Nothing => self.element_m2,
        }
    }
}

/// The normal of a triangle, if it has one.
fn normal_of(triangle: &[DVec3; 3]) -> Option<DVec3> {
    let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
    normal.try_normalize()
}

/// Calls `count` with each row of a part of the scene, whose block is `scene`, and how many rays a job casts from it.
pub(crate) fn count_of_rows(
    scene: &Block,
    owned: &Owned,
    batch: &Batch,
    mut count: impl FnMut(u32, u32),
) {
    let Some(rays) = &batch.rays else { return };
    let share = Share::of(rays, batch);
    let asked = rays.part.of(owned.triangles.len());
    let mut row = 0;
    for (k, &(t, is_owned)) in owned.triangles.iter().enumerate() {
        let t = t as usize;
        let elements = scene.elements.of(t);
        if !is_owned {
            continue;
        }
        let triangle = &scene.soup.triangle(t);
        if !asked.contains(&k) || normal_of(triangle).is_none() {
            row += 2 * elements.len() as u32;
            continue;
        }
        let size = Size::of(triangle, scene.elements.divisions[t]);
        for element in elements {
            let area_m2 = size.above_m2(&scene.above_soil(triangle, t, element));
            for side in 0..2 {
                let rays = share.rays_of(area_m2, size.longest_m, 2 * element + side);
                count(row, rays);
                row += 1;
            }
        }
    }
    let Some(soil) = &scene.soil else { return };
    let asked = rays.part.of(scene.ends.soil_cells as usize);
    for &cell in owned.soil_cells {
        if asked.contains(&(cell as usize)) {
            count(row, share.of_cell(soil, scene.ends.soil(cell)));
        }
        row += 1;
    }
}

fn from_triangle(block: &Block, tracer: &Tracer, share: &Share, t: usize, looks: &mut Vec<Pair>) {
    let triangle = &block.soup.triangle(t);
    let Some(normal) = normal_of(triangle) else {
        return;
    };
    let n = block.elements.divisions[t];
    let size = Size::of(triangle, n);
    for local in block.elements.of(t) {
        let above = block.above_soil(triangle, t, local);
        let area_m2 = size.above_m2(&above);
        for side in 0..2 {
            let face = 2 * local + side;
            if block.row_of(face).is_none() {
                continue;
            }
            let global = block.number_of(face);
            let count = share.rays_of(area_m2, size.longest_m, global);
            if count == 0 {
                continue;
            }
            let mut rng = share.numbers(global);
            let outward = if side == 0 { normal } else { -normal };
            let corners = elements::piece_corners(n, local - block.elements.first[t]);
            for k in 0..count {
                let [first, second] = [rng.random(), rng.random()];
                let (corners, first) = match &above {
                    Above::Part(part) => part.triangle(first),
                    Above::Whole | Above::Nothing => (corners, first),
                };
                let origin = geometry::point_within(triangle, &corners, [first, second]);
                let direction = cosine_direction(outward, (k, count), &mut rng);
                let ray = FaceRay {
                    face,
                    origin,
                    direction,
                    source: Some(t as u32),
                };
                looks.push((face, tracer.seen(block, &ray, rng.random())));
            }
        }
    }
}

fn from_soil(
    block: &Block,
    tracer: &Tracer,
    share: &Share,
    cells: Range<usize>,
    looks: &mut Vec<Pair>,
) {
    let Some(soil) = &block.soil else { return };
    for cell in cells.start as u32..cells.end as u32 {
        let end = block.ends.soil(cell);
        let row = block.local(end);
        if block.row_of(row).is_none() {
            continue;
        }
        let count = share.of_cell(soil, end);
        let mut rng = share.numbers(end);
        let at = DVec2::new(
            f64::from(cell % soil.cells[0]),
            f64::from(cell / soil.cells[0]),
        );
        for k in 0..count {
            let within = DVec2::new(rng.random(), rng.random());
            let origin = (soil.min_m + (at + within) * soil.cell_m).extend(soil.z_m);
            let direction = cosine_direction(DVec3::Z, (k, count), &mut rng);
            let ray = FaceRay {
                face: row,
                origin,
                direction,
                source: None,
            };
            looks.push((row, tracer.seen(block, &ray, rng.random())));
        }
    }
}

/// A direction whose density is the cosine to `normal` over pi (Malley's method); the squared sines
/// of the `count` directions of a face are stratified.
fn cosine_direction(normal: DVec3, (k, count): (u32, u32), rng: &mut Pcg64Mcg) -> DVec3 {
    let u: f64 = (f64::from(k) + rng.random::<f64>()) / f64::from(count);
    let azimuth: f64 = std::f64::consts::TAU * rng.random::<f64>();
    let (e1, e2) = normal.any_orthonormal_pair();
    let r = u.sqrt();
    e1 * (r * azimuth.cos()) + e2 * (r * azimuth.sin()) + normal * (1.0 - u).max(1e-12).sqrt()
}
