//! Which part of the scene a block holds; this is the one place where a block is made ready for the kernel.

use std::sync::Arc;

use nestrad_kernel::block::{BlockFrame, CellRun, TriangleRun};
use nestrad_kernel::owned::Owned;
use nestrad_kernel::{Block, BlockFault};

use crate::frame::{Frame, joined};

/// Which triangles and soil cells a block holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BlockOf {
    /// Number in the frame, and whether rows of it are wanted; by rising number.
    pub triangles: Vec<(u32, bool)>,
    /// Soil cells whose rows are wanted, rising.
    pub soil_cells: Vec<u32>,
}

impl BlockOf {
    /// The whole scene as one block.
    pub fn whole(frame: &Frame) -> Self {
        let triangles = frame.organ.len() as u32;
        Self {
            triangles: (0..triangles).map(|t| (t, true)).collect(),
            soil_cells: (0..frame.ends.soil_cells).collect(),
        }
    }

    /// Whether it is the whole scene.
    pub fn is_whole(&self, frame: &Frame) -> bool {
        self.triangles.len() == frame.organ.len()
            && self.soil_cells.len() == frame.ends.soil_cells as usize
            && self.triangles.iter().all(|&(_, owned)| owned)
    }

    /// What of the scene it holds.
    pub fn owned(&self) -> Owned<'_> {
        Owned {
            triangles: &self.triangles,
            soil_cells: &self.soil_cells,
        }
    }

    /// The block, ready for the kernel.
    pub fn ready(&self, frame: &Frame) -> Result<Block, BlockFault> {
        if self.is_whole(frame) {
            return Ok(frame.block().clone());
        }
        let soup = self.corners(frame).collect();
        Block::new(&self.frame(frame), Arc::new(soup))
    }

    /// The vertices of its triangles, metres.
    pub fn corners(&self, frame: &Frame) -> impl ExactSizeIterator<Item = [glam::DVec3; 3]> {
        let triangles = self.triangles.iter();
        triangles.map(|&(t, _)| frame.soup().triangle(t as usize))
    }

    /// All of the block but its triangles.
    pub fn frame(&self, frame: &Frame) -> BlockFrame {
        let mut next_element = 0;
        let runs = self.triangles.iter().map(|&(t, owned)| {
            let t = t as usize;
            let elements = frame.elements().of(t);
            let skipped_elements = elements.start - next_element;
            next_element = elements.end;
            TriangleRun {
                triangles: 1,
                skipped_elements,
                divisions: frame.elements().divisions[t],
                owned,
                solid: frame.is_solid(t),
            }
        });
        BlockFrame {
            world: frame.world.clone(),
            runs: joined(runs),
            owned_soil: cell_runs(&self.soil_cells),
        }
    }

    /// How many rows it has.
    pub fn count_rows(&self, frame: &Frame) -> u32 {
        let owned = self.triangles.iter().filter(|&&(_, owned)| owned);
        let elements = owned.map(|&(t, _)| frame.elements().of(t as usize).len() as u32);
        2 * elements.sum::<u32>() + self.soil_cells.len() as u32
    }

    /// The rows of the scene that the block's rows are, in order.
    pub(super) fn rows(&self, frame: &Frame) -> Vec<u32> {
        let mut rows = Vec::new();
        for &(t, owned) in &self.triangles {
            if owned {
                let elements = frame.elements().of(t as usize);
                rows.extend(2 * elements.start..2 * elements.end);
            }
        }
        rows.extend(self.soil_cells.iter().map(|&c| frame.ends.soil(c)));
        rows
    }
}

/// Runs of cells whose numbers rise.
fn cell_runs(cells: &[u32]) -> Vec<CellRun> {
    let mut next = 0;
    let runs = cells.chunk_by(|a, b| a + 1 == *b).map(|run| {
        let skipped_cells = run[0] - next;
        next = run[0] + run.len() as u32;
        CellRun {
            cells: run.len() as u32,
            skipped_cells,
        }
    });
    runs.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_follow_one_another_are_a_run() {
        let run = |skipped_cells, cells| CellRun {
            cells,
            skipped_cells,
        };
        assert_eq!(cell_runs(&[]), []);
        assert_eq!(cell_runs(&[0, 1, 2]), [run(0, 3)]);
        let runs = [run(3, 2), run(2, 1), run(1, 2)];
        assert_eq!(cell_runs(&[3, 4, 7, 9, 10]), runs);
    }
}
