//! Blocks: the scene cut into columns that fit a worker's memory, each with all that lies within the
//! sphere's radius of it.

use glam::DVec2;
use nestrad_common::geometry;

use super::ExchangeError;
use super::blocks::BlockOf;
use super::sampling::Sampling;
use super::split::demand;
use crate::frame::Frame;

/// A block is not cut further where it has so many times as many triangles as those that it owns: smaller blocks would
/// make more work for everybody than a worker that is too small for this one can do.
const MOST_AROUND: usize = 16;

/// Blocks that own fewer triangles than this are small by any measure.
const LEAST_OWNED: usize = 64;

/// The smallest of the workers that are to compute a solve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SmallestWorker {
    /// Memory that it may take, bytes.
    pub memory_bytes: u64,
    /// Jobs that it computes at a time.
    pub threads: u32,
}

/// Cuts the scene into as few blocks as a worker's memory allows: into halves, and these again, where the
/// triangles of a part are divided evenly. A worker holds two blocks while it goes from one to the next.
///
/// A near field without bounds needs the whole scene for every row: then there is one block or none.
pub fn partition(
    frame: &Frame,
    sampling: &Sampling,
    worker: SmallestWorker,
) -> Result<Vec<BlockOf>, ExchangeError> {
    const GIB: f64 = (1u64 << 30) as f64;
    let needs = |block: &BlockOf, held: u64| {
        demand(frame, block, sampling).worker_bytes(worker.threads, held)
    };
    let whole = BlockOf::whole(frame);
    let needed = needs(&whole, 1);
    if needed <= worker.memory_bytes {
        return Ok(vec![whole]);
    }
    let too_large = |needed: u64| ExchangeError::BlockTooLarge {
        needed_GiB: needed as f64 / GIB,
        limit_GiB: worker.memory_bytes as f64 / GIB,
        bounded: frame.world.radius_m.is_finite(),
    };
    if !frame.world.radius_m.is_finite() {
        return Err(too_large(needed));
    }
    let map = Map::new(frame);
    let mut blocks = Vec::new();
    let mut open = vec![Part {
        owned: whole.triangles.iter().map(|&(t, _)| t).collect(),
        cells: whole.soil_cells,
        around: whole.triangles.iter().map(|&(t, _)| t).collect(),
    }];
    while let Some(mut part) = open.pop() {
        let block = map.block(&mut part);
        let needed = needs(&block, 2);
        if needed <= worker.memory_bytes {
            blocks.push(block);
            continue;
        }
        // what is around would be traced again and again
        if part.around.len() > MOST_AROUND * part.owned.len().max(LEAST_OWNED) {
            return Err(too_large(needed));
        }
        let [a, b] = map.halves(part);
        if a.is_empty() || b.is_empty() {
            return Err(too_large(needed));
        }
        open.extend([b, a]);
    }
    Ok(blocks)
}

/// A part of the scene on the way to become a block.
struct Part {
    /// Triangles whose rows it has, rising.
    owned: Vec<u32>,
    /// Soil cells whose rows it has, rising.
    cells: Vec<u32>,
    /// All triangles that can be near, rising.
    around: Vec<u32>,
}

impl Part {
    fn is_empty(&self) -> bool {
        self.owned.is_empty() && self.cells.is_empty()
    }
}

/// Where everything is on the ground.
struct Map<'a> {
    frame: &'a Frame,
    /// Box of each triangle, moved by whole patterns so that its middle is in the pattern.
    boxes: Vec<[DVec2; 2]>,
    /// Size of the pattern; `None` in an open scene.
    period_m: Option<DVec2>,
    /// How far a near face can be, metres.
    reach_m: f64,
}

impl<'a> Map<'a> {
    fn new(frame: &'a Frame) -> Self {
        let extent = &frame.world.extent;
        let (min, max) = (extent.min_m.truncate(), extent.max_m.truncate());
        let period_m = extent.periodic.then_some(max - min);
        let boxes = frame
            .soup()
            .triangles()
            .map(|triangle| {
                let (a, b) = geometry::bounds(&triangle).unwrap_or_default();
                let (a, b) = (a.truncate(), b.truncate());
                let shift = period_m.map_or(DVec2::ZERO, |size| {
                    ((0.5 * (a + b) - min) / size).floor() * size
                });
                [a - shift, b - shift]
            })
            .collect();
        Self {
            frame,
            boxes,
            period_m,
            // distances are compared in steps of a lattice, on lattices whose points are rounded
            reach_m: frame.world.radius_m * 1.001 + 1e-5 * (max - min).max_element(),
        }
    }

    fn cell(&self, cell: u32) -> [DVec2; 2] {
        self.frame.world.soil.map_or([DVec2::ZERO; 2], |soil| {
            let corner = soil.corner_m(cell);
            [corner, corner + soil.cell_m]
        })
    }

    /// The block of a part; what cannot be near is struck off the part's list.
    fn block(&self, part: &mut Part) -> BlockOf {
        let all = |boxes: &mut dyn Iterator<Item = [DVec2; 2]>| {
            boxes.fold(
                [DVec2::INFINITY, DVec2::NEG_INFINITY],
                |[lo, hi], [a, b]| [lo.min(a), hi.max(b)],
            )
        };
        let [a, b] = all(&mut part.owned.iter().map(|&t| self.boxes[t as usize]));
        let [c, d] = all(&mut part.cells.iter().map(|&c| self.cell(c)));
        let near = [a.min(c) - self.reach_m, b.max(d) + self.reach_m];
        part.around
            .retain(|&t| self.meet(near, self.boxes[t as usize]));
        let mut owned = part.owned.iter().peekable();
        BlockOf {
            triangles: part
                .around
                .iter()
                .map(|&t| (t, owned.next_if(|&&o| o == t).is_some()))
                .collect(),
            soil_cells: part.cells.clone(),
        }
    }

    /// Whether two boxes have a point in common, or a copy of one has with the other.
    fn meet(&self, [a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
        match self.period_m {
            None => c.cmple(b).all() && a.cmple(d).all(),
            Some(size) => (((a - d) / size).ceil())
                .cmple(((b - c) / size).floor())
                .all(),
        }
    }

    /// Two parts with as many triangles each, cut across the longer side.
    fn halves(&self, part: Part) -> [Part; 2] {
        let middle = |[a, b]: [DVec2; 2]| 0.5 * (a + b);
        let of_triangle = |t: u32| middle(self.boxes[t as usize]);
        let of_cell = |c: u32| middle(self.cell(c));
        let middles: Vec<DVec2> = if part.owned.is_empty() {
            part.cells.iter().map(|&c| of_cell(c)).collect()
        } else {
            part.owned.iter().map(|&t| of_triangle(t)).collect()
        };
        let (lo, hi) = middles
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), &m| {
                (lo.min(m), hi.max(m))
            });
        let along_x = hi.x - lo.x >= hi.y - lo.y;
        let place = |m: DVec2| if along_x { m.x } else { m.y };
        let mut places: Vec<f64> = middles.into_iter().map(place).collect();
        let half = places.len() / 2;
        let (_, &mut cut, _) = places.select_nth_unstable_by(half, f64::total_cmp);
        let (a, b) = part
            .owned
            .iter()
            .partition(|&&t| place(of_triangle(t)) < cut);
        let (c, d) = part.cells.iter().partition(|&&c| place(of_cell(c)) < cut);
        let around = part.around.clone();
        [(a, c, part.around), (b, d, around)].map(|(owned, cells, around)| Part {
            owned,
            cells,
            around,
        })
    }
}
