//! Who sees whom along a line.

use std::ops::Range;

use super::burial::bury;
use super::fragments::Hit;
use crate::block::Block;
use crate::far_grid::{Exit, Passage};
use crate::ground::{Along, Ground};
use crate::lattice::{DEPTH_OF_TOP, Lattice};
use crate::rows::Pair;
use crate::soil::SoilGrid;

/// Turns the sorted hits of a line into pairs that see each other.
pub(crate) struct Sight<'a> {
    block: &'a Block,
    lattice: &'a Lattice,
    soil: Option<SoilUnder>,
    sky: u32,
    void: u32,
    outer_soil: u32,
    first_zone: u32,
    /// The sphere's radius in depth steps; `None` when nothing is ever that far away.
    radius: Option<u32>,
}

impl<'a> Sight<'a> {
    pub(crate) fn new(block: &'a Block, lattice: &'a Lattice) -> Self {
        let ends = &block.ends;
        let steps = (block.radius_m / lattice.distance_m(1)).ceil();
        Self {
            block,
            lattice,
            soil: block
                .soil
                .zip(block.ground)
                .map(|(soil, ground)| SoilUnder::new(soil.z_m, ground, lattice)),
            sky: block.local(ends.sky()),
            void: block.local(ends.void()),
            outer_soil: block.local(ends.outer_soil()),
            first_zone: block.local(ends.zone(0)),
            radius: (steps < f64::from(u32::MAX)).then_some(steps as u32),
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
            if self.block.is_cut_by_soil(hit.face_along()) {
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
        let first = self.block.local(self.block.ends.far(0));
        let leaving = |exit: Exit| first + exit.row(self.block.ends.far_ends);
        let at_top = hits.last().map_or(bottom, |h| h.face_along());
        let at_bottom = hits.first().map_or(self.sky, |h| h.face_against());
        looks.push((leaving(Exit::Up), at_top));
        looks.push((leaving(Exit::Down), at_bottom));
        let Some(radius) = self.radius else { return };
        let (mut seen, mut depth) = (bottom, soil_depth);
        for hit in hits {
            if hit.depth().saturating_sub(depth) > radius {
                if !self.is_below(seen) {
                    looks.push((self.far_above(line, depth, radius), hit.face_against()));
                }
                looks.push((self.far_below(line, hit.depth(), radius), seen));
            }
            (seen, depth) = (hit.face_along(), hit.depth());
        }
        let above = self.far_above(line, depth, radius);
        if above != self.sky && !self.is_below(seen) {
            looks.push((above, self.sky));
        }
    }

    /// What is at the lower end of a line.
    fn bottom(&self, line: usize) -> u32 {
        let soil = self.soil.as_ref();
        soil.map_or(self.void, |soil| self.block.local(soil.end(line)))
    }

    /// Whether a local end is what lies below the scene, other than its soil.
    fn is_below(&self, end: u32) -> bool {
        end == self.void || end == self.outer_soil || end >= self.first_zone
    }

    /// What is seen upwards, where nothing is hit within the sphere.
    fn far_above(&self, line: usize, depth: u32, radius: u32) -> u32 {
        match depth.checked_add(radius) {
            Some(at) if at < DEPTH_OF_TOP => self.far(line, at, self.lattice.direction.z),
            _ => self.sky,
        }
    }

    /// What is seen downwards, where nothing is hit within the sphere.
    fn far_below(&self, line: usize, depth: u32, radius: u32) -> u32 {
        let at = depth.saturating_sub(radius);
        self.far(line, at, -self.lattice.direction.z)
    }

    /// The far end that stands for what is seen along a line past a depth; random by line and depth.
    fn far(&self, line: usize, depth: u32, direction_z: f64) -> u32 {
        let Some(grid) = &self.block.far else {
            return match (direction_z < 0.0, &self.soil) {
                (false, _) => self.sky,
                (true, Some(_)) => self.outer_soil,
                (true, None) => self.void,
            };
        };
        let hash = ((line as u64) << 32 | u64::from(depth)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let nx = self.lattice.nx as usize;
        let end = grid.end_at(&Passage {
            height: f64::from(depth) / f64::from(DEPTH_OF_TOP),
            at_m: &|| {
                let (i, j) = ((line % nx) as f64, (line / nx) as f64);
                let z_m = self.lattice.height_m(depth);
                self.lattice.point_at(i, j, z_m).truncate()
            },
            direction_z,
            random: (hash >> 11) as f64 / (1u64 << 53) as f64,
        });
        self.block.local(self.block.ends.far(end))
    }
}

/// How many lines of some rows of a lattice end on each cell of the soil, in the order of their numbers: with rows
/// and columns of cells, that is one number for each of them, to be multiplied.
pub(crate) struct LinesOnSoil {
    columns: Vec<u64>,
    rows: Vec<u64>,
}

impl LinesOnSoil {
    pub(crate) fn new(
        soil: &SoilGrid,
        ground: Ground,
        lattice: &Lattice,
        rows: Range<u32>,
    ) -> Self {
        let under = SoilUnder::new(soil.z_m, ground, lattice);
        let count = |places: &[Along], cells: u32| {
            let mut counts = vec![0; cells as usize];
            for cell in places.iter().filter_map(|place| place.cell) {
                counts[cell as usize] += 1;
            }
            counts
        };
        Self {
            columns: count(&under.column, soil.cells[0]),
            rows: count(
                &under.row[rows.start as usize..rows.end as usize],
                soil.cells[1],
            ),
        }
    }

    /// Of the cell of that number.
    pub(crate) fn of(&self, cell: u32) -> u64 {
        let columns = self.columns.len();
        self.columns[cell as usize % columns] * self.rows[cell as usize / columns]
    }
}

/// The soil at the lower ends of the lines.
struct SoilUnder {
    depth: u32,
    ground: Ground,
    /// Column and row of the soil for each column and row of the lattice.
    column: Vec<Along>,
    row: Vec<Along>,
}

impl SoilUnder {
    fn new(z_m: f64, ground: Ground, lattice: &Lattice) -> Self {
        let place = |i: u32, j: u32| lattice.point_at(f64::from(i), f64::from(j), z_m);
        Self {
            depth: lattice.depth_of_height(z_m),
            column: (0..lattice.nx)
                .map(|i| ground.along(0, place(i, 0).x))
                .collect(),
            row: (0..lattice.ny)
                .map(|j| ground.along(1, place(0, j).y))
                .collect(),
            ground,
        }
    }

    /// The end at the lower end of a line.
    fn end(&self, line: usize) -> u32 {
        let nx = self.column.len();
        self.ground.end(self.column[line % nx], self.row[line / nx])
    }
}
