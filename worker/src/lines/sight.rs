//! Who sees whom along a line.

use nestrad_common::lattice::{DEPTH_OF_TOP, Lattice};

use super::burial::bury;
use super::fragments::Hit;
use crate::block::{Block, Soil};
use crate::rows::Pair;

/// Turns the sorted hits of a line into pairs that see each other.
pub(crate) struct Sight<'a> {
    block: &'a Block,
    soil: Option<SoilUnder>,
    sky: u32,
    below: u32,
    /// The sphere's radius in depth steps; `None` when nothing is ever that far away.
    radius: Option<u32>,
    bin: u32,
}

impl<'a> Sight<'a> {
    pub(crate) fn new(block: &'a Block, lattice: &Lattice) -> Self {
        let ends = &block.ends;
        let steps = (block.radius_m / lattice.distance_m(1)).ceil();
        Self {
            block,
            soil: block.soil.map(|soil| SoilUnder::new(&soil, lattice)),
            sky: block.local(ends.sky()),
            below: block.local(if block.soil.is_some() {
                ends.outer_soil()
            } else {
                ends.void()
            }),
            radius: (steps < f64::from(u32::MAX)).then_some(steps as u32),
            bin: ends.far_bin(lattice.direction.z),
        }
    }

    /// Adds the pairs along one line; `hits` by rising depth.
    pub(crate) fn along(&self, line: usize, hits: &[Hit], pairs: &mut Vec<Pair>) {
        let start = pairs.len();
        let soil_depth = self.soil.as_ref().map_or(0, |soil| soil.depth);
        let (under, hits) = hits.split_at(hits.partition_point(|h| h.depth() < soil_depth));
        self.neighbours(line, hits, soil_depth, pairs);
        if hits.iter().any(|h| self.block.is_solid(h.face_along())) {
            bury(self.block, hits, self.radius, pairs, start);
        }
        // what lies under the soil gets no light and is not seen; how much that is of what the soil cuts is known
        let buried = self.block.local(self.block.ends.buried());
        for hit in under {
            if self.block.cut_by_soil[hit.face_along() as usize / 2] {
                continue;
            }
            pairs.push((hit.face_against(), buried));
            pairs.push((hit.face_along(), buried));
        }
    }

    fn neighbours(&self, line: usize, hits: &[Hit], soil_depth: u32, pairs: &mut Vec<Pair>) {
        let bottom = self.bottom(line);
        let Some(radius) = self.radius else {
            let mut seen = bottom;
            for hit in hits {
                pairs.push((seen, hit.face_against()));
                seen = hit.face_along();
            }
            pairs.push((seen, self.sky));
            return;
        };

        let (mut seen, mut depth) = (bottom, soil_depth);
        for hit in hits {
            if hit.depth().saturating_sub(depth) <= radius {
                pairs.push((seen, hit.face_against()));
            } else {
                pairs.push((seen, self.far_above(line, depth, radius)));
                pairs.push((
                    hit.face_against(),
                    self.far_below(line, hit.depth(), radius),
                ));
            }
            (seen, depth) = (hit.face_along(), hit.depth());
        }
        pairs.push((seen, self.far_above(line, depth, radius)));
    }

    /// Adds what stands, along one line, at the other end of each look into the far field: (far end, what
    /// is there), and what leaves at the line's ends.
    ///
    /// So the far field is the mean over just those lines of sight that are longer than the sphere reaches,
    /// and what one end of them sends out is what the others get.
    pub(crate) fn beyond(&self, line: usize, hits: &[Hit], looks: &mut Vec<Pair>) {
        let soil_depth = self.soil.as_ref().map_or(0, |soil| soil.depth);
        let hits = &hits[hits.partition_point(|h| h.depth() < soil_depth)..];
        let bottom = self.bottom(line);
        let leaves = self.block.local_ends();
        looks.push((leaves, hits.last().map_or(bottom, |h| h.face_along())));
        looks.push((
            leaves + 1,
            hits.first().map_or(self.sky, |h| h.face_against()),
        ));
        let Some(radius) = self.radius else { return };
        let (mut seen, mut depth) = (bottom, soil_depth);
        for hit in hits {
            if hit.depth().saturating_sub(depth) > radius {
                if seen != self.below {
                    looks.push((self.far_above(line, depth, radius), hit.face_against()));
                }
                looks.push((self.far_below(line, hit.depth(), radius), seen));
            }
            (seen, depth) = (hit.face_along(), hit.depth());
        }
        let above = self.far_above(line, depth, radius);
        if above != self.sky && seen != self.below {
            looks.push((above, self.sky));
        }
    }

    /// What is at the lower end of a line.
    fn bottom(&self, line: usize) -> u32 {
        let cell = self.soil.as_ref().and_then(|soil| soil.cell(line));
        cell.map_or(self.below, |c| self.block.local(self.block.ends.soil(c)))
    }

    /// What is seen upwards, where nothing is hit within the sphere.
    fn far_above(&self, line: usize, depth: u32, radius: u32) -> u32 {
        match depth.checked_add(radius) {
            Some(at) if at < DEPTH_OF_TOP => {
                let level = self.level(line, at);
                self.block
                    .local(self.block.ends.far_from_above(self.bin, level))
            }
            _ => self.sky,
        }
    }

    /// What is seen downwards, where nothing is hit within the sphere.
    fn far_below(&self, line: usize, depth: u32, radius: u32) -> u32 {
        let level = self.level(line, depth.saturating_sub(radius));
        self.block
            .local(self.block.ends.far_from_below(self.bin, level))
    }

    /// One of the two levels around a depth, at random with the weights of linear interpolation:
    /// so the mean over lines is the interpolated value, and every end keeps the same weight.
    fn level(&self, line: usize, depth: u32) -> u32 {
        let last = self.block.ends.far_levels.saturating_sub(1);
        let at = f64::from(depth) / f64::from(DEPTH_OF_TOP) * f64::from(last);
        let hash = ((line as u64) << 32 | u64::from(depth)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let random = (hash >> 11) as f64 / (1u64 << 53) as f64;
        ((at + random) as u32).min(last)
    }
}

/// The soil cells at the lower ends of the lines.
struct SoilUnder {
    depth: u32,
    /// Column and row of cells for each column and row of the lattice; `None` beyond the map.
    column: Vec<Option<u32>>,
    row: Vec<Option<u32>>,
    columns: u32,
}

impl SoilUnder {
    fn new(soil: &Soil, lattice: &Lattice) -> Self {
        let cell = |x: f64, min: f64, size: f64, cells: u32| {
            let k = ((x - min) / size).floor();
            if lattice.periodic {
                Some((k as i64).rem_euclid(i64::from(cells)) as u32)
            } else {
                (k >= 0.0 && k < f64::from(cells)).then_some(k as u32)
            }
        };
        let place = |i: u32, j: u32| lattice.point_at(f64::from(i), f64::from(j), soil.z_m);
        Self {
            depth: lattice.depth_of_height(soil.z_m),
            column: (0..lattice.nx)
                .map(|i| cell(place(i, 0).x, soil.min_m.x, soil.cell_m.x, soil.cells[0]))
                .collect(),
            row: (0..lattice.ny)
                .map(|j| cell(place(0, j).y, soil.min_m.y, soil.cell_m.y, soil.cells[1]))
                .collect(),
            columns: soil.cells[0],
        }
    }

    /// The cell at the lower end of a line.
    fn cell(&self, line: usize) -> Option<u32> {
        let nx = self.column.len();
        Some(self.row[line / nx]? * self.columns + self.column[line % nx]?)
    }
}
