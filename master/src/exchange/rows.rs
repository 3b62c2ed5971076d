//! Rows of the exchange, and how those of a batch's blocks are joined.

use nestrad_proto::v1;

use super::ExchangeError;
use super::jobs::BlockOf;
use crate::world::World;

/// The rows of one batch.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BatchRows {
    /// Start of each row in `ends`, and its length at the end.
    pub start: Vec<u32>,
    /// What is seen, one entry per line or ray.
    pub ends: Vec<u32>,
}

impl BatchRows {
    /// Rows of these lengths.
    pub fn new(lengths: &[u32], ends: Vec<u32>) -> Self {
        let mut start = Vec::with_capacity(lengths.len() + 1);
        let mut total = 0;
        start.push(0);
        for l in lengths {
            total += l;
            start.push(total);
        }
        Self { start, ends }
    }

    /// What a row sees.
    #[inline]
    pub fn row(&self, row: usize) -> &[u32] {
        &self.ends[self.start[row] as usize..self.start[row + 1] as usize]
    }
}

/// Puts the rows of all blocks of a batch into the scene's order.
pub(super) fn put_together(
    world: &World,
    batch: u32,
    mut parts: Vec<(&BlockOf, v1::Rows)>,
) -> Result<BatchRows, ExchangeError> {
    let rows_of: Vec<Vec<u32>> = parts.iter().map(|(block, _)| block.rows(world)).collect();
    let mut length = vec![0u32; world.rows()];
    for (numbers, (_, rows)) in rows_of.iter().zip(&parts) {
        let fault = |what, found, expected| ExchangeError::Result {
            batch,
            what,
            found,
            expected,
        };
        if rows.lengths.len() != numbers.len() {
            return Err(fault("rows", rows.lengths.len(), numbers.len()));
        }
        let entries = rows.lengths.iter().map(|&l| l as usize).sum();
        if rows.ends.len() != entries {
            return Err(fault("entries", rows.ends.len(), entries));
        }
        if let Some(&end) = rows.ends.iter().find(|&&e| e as usize >= world.ends.len()) {
            return Err(fault(
                "as the number of something seen",
                end as usize,
                world.ends.len(),
            ));
        }
        for (&row, &l) in numbers.iter().zip(&rows.lengths) {
            length[row as usize] = l;
        }
    }
    // one block holds the scene in the scene's order
    if let [(_, rows)] = &mut parts[..] {
        return Ok(BatchRows::new(&length, std::mem::take(&mut rows.ends)));
    }
    let entries = length.iter().map(|&l| l as usize).sum();
    let mut joined = BatchRows::new(&length, vec![0; entries]);
    for (numbers, (_, rows)) in rows_of.iter().zip(&parts) {
        let mut from = 0;
        for (&row, &l) in numbers.iter().zip(&rows.lengths) {
            let to = joined.start[row as usize] as usize;
            joined.ends[to..to + l as usize].copy_from_slice(&rows.ends[from..from + l as usize]);
            from += l as usize;
        }
    }
    Ok(joined)
}
