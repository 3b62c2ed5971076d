//! How the ends of a block are numbered.

use super::BlockFrame;
use super::fault::{BlockFault, require};
use crate::ends::Ends;

/// Local ends, the rows that are wanted of them, and their numbers in the scene.
pub(super) struct Numbering {
    /// Faces of local elements; local ends from here on are not faces.
    pub(super) local_faces: u32,
    /// Local ends.
    pub(super) local_ends: u32,
    /// Number of rows.
    pub(super) rows: u32,
    /// Absent where local ends have the numbers of the scene, and rows those of ends: in a block of the whole scene.
    of_part: Option<Numbers>,
}

struct Numbers {
    /// What each local end is seen as: its number in the scene.
    seen_as: Vec<u32>,
    /// Row of each local end, or [`NO_ROW`].
    row: Vec<u32>,
}

/// More than there are rows.
const NO_ROW: u32 = u32::MAX;

impl Numbering {
    /// Of runs of triangles that have so many elements together.
    pub(super) fn new(
        frame: &BlockFrame,
        ends: &Ends,
        elements: usize,
    ) -> Result<Self, BlockFault> {
        let local_faces = 2 * elements as u32;
        let others = ends.len() as u32 - ends.faces();
        let mut numbering = Self {
            local_faces,
            local_ends: local_faces + others,
            rows: local_faces + ends.soil_cells,
            of_part: None,
        };
        let is_whole = owned_cells(frame, ends)? == ends.soil_cells
            && elements == ends.elements as usize
            && frame.runs.iter().all(|run| run.owned);
        if !is_whole {
            let (numbers, rows) = Numbers::of(frame, ends, numbering.local_ends as usize);
            (numbering.of_part, numbering.rows) = (Some(numbers), rows);
        }
        Ok(numbering)
    }

    /// The row of a local end, where one is wanted.
    #[inline]
    pub(super) fn row(&self, local: u32) -> Option<u32> {
        let row = match &self.of_part {
            Some(numbers) => numbers.row[local as usize],
            None => local,
        };
        (row < self.rows).then_some(row)
    }

    /// What a local end is seen as.
    #[inline]
    pub(super) fn number(&self, local: u32) -> u32 {
        match &self.of_part {
            Some(numbers) => numbers.seen_as[local as usize],
            None => local,
        }
    }
}

/// How many soil cells have rows; all of them are checked to be in the map.
fn owned_cells(frame: &BlockFrame, ends: &Ends) -> Result<u32, BlockFault> {
    let (mut owned, mut end) = (0, 0u64);
    for run in &frame.owned_soil {
        end += u64::from(run.skipped_cells) + u64::from(run.cells);
        require(end <= u64::from(ends.soil_cells), "owned_soil")?;
        owned += run.cells;
    }
    Ok(owned)
}

impl Numbers {
    /// The numbers of a part of the scene, and how many rows it has.
    fn of(frame: &BlockFrame, ends: &Ends, local_ends: usize) -> (Self, u32) {
        let (mut seen_as, mut row) = (
            Vec::with_capacity(local_ends),
            Vec::with_capacity(local_ends),
        );
        let (mut rows, mut next) = (0u32, 0u32);
        for run in &frame.runs {
            let faces = 2 * run.triangles * run.divisions.pow(2);
            next += 2 * run.skipped_elements;
            seen_as.extend(next..next + faces);
            next += faces;
            if run.owned {
                row.extend(rows..rows + faces);
                rows += faces;
            } else {
                row.resize(row.len() + faces as usize, NO_ROW);
            }
        }
        let local_faces = row.len();
        seen_as.extend(ends.faces()..ends.len() as u32);
        row.resize(seen_as.len(), NO_ROW);
        let mut next = local_faces;
        for run in &frame.owned_soil {
            next += run.skipped_cells as usize;
            let own = next..next + run.cells as usize;
            next = own.end;
            for place in &mut row[own] {
                *place = rows;
                rows += 1;
            }
        }
        (Self { seen_as, row }, rows)
    }
}
