//! Rows of the exchange: of a batch, of a half.

use std::ops::Range;

use rayon::prelude::*;

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

/// The rows of all batches of a half, joined: a sweep reads each row as one list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HalfRows {
    /// Number of batches.
    batches: usize,
    /// Start of each row in `ends`, and the length of `ends` at the end.
    start: Vec<u64>,
    /// Where the entries of each batch end in a row, from the row's start: `row * batches + batch`.
    batch_end: Vec<u32>,
    /// What is seen, one entry per line or ray; by row, then by batch.
    ends: Vec<u32>,
}

/// Rows that are joined as one task.
const JOINED_AT_ONCE: usize = 4096;

impl HalfRows {
    /// Joins the batches of a half.
    pub fn join(batches: &[BatchRows]) -> Self {
        let rows = batches.first().map_or(0, |b| b.start.len() - 1);
        let (mut start, mut batch_end) = (vec![0], Vec::with_capacity(rows * batches.len()));
        let mut total = 0;
        for row in 0..rows {
            let mut end = 0;
            for batch in batches {
                end += batch.start[row + 1] - batch.start[row];
                batch_end.push(end);
            }
            total += u64::from(end);
            start.push(total);
        }
        let mut ends = vec![0; total as usize];
        let mut parts = Vec::with_capacity(rows.div_ceil(JOINED_AT_ONCE));
        let mut rest = &mut ends[..];
        for first in (0..rows).step_by(JOINED_AT_ONCE) {
            let last = (first + JOINED_AT_ONCE).min(rows);
            let (part, left) = rest.split_at_mut((start[last] - start[first]) as usize);
            parts.push((first..last, part));
            rest = left;
        }
        parts.into_par_iter().for_each(|(rows, mut part)| {
            for row in rows {
                for batch in batches {
                    let entries = batch.row(row);
                    let (to, left) = part.split_at_mut(entries.len());
                    to.copy_from_slice(entries);
                    part = left;
                }
            }
        });
        Self {
            batches: batches.len(),
            start,
            batch_end,
            ends,
        }
    }

    /// What a row sees.
    #[inline]
    pub fn row(&self, row: usize) -> &[u32] {
        &self.ends[self.range(row)]
    }

    /// Where what a row sees stands among [`Self::ends`].
    #[inline]
    pub fn range(&self, row: usize) -> Range<usize> {
        self.start[row] as usize..self.start[row + 1] as usize
    }

    /// What is seen, row after row.
    #[inline]
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    /// Where what a row sees in each batch stands among [`Self::ends`], in order.
    pub fn by_batch(&self, row: usize) -> impl Iterator<Item = Range<usize>> {
        let start = self.start[row] as usize;
        let end = &self.batch_end[row * self.batches..(row + 1) * self.batches];
        (0..self.batches).map(move |g| {
            let first = if g == 0 { 0 } else { end[g - 1] };
            start + first as usize..start + end[g] as usize
        })
    }

    /// Number of entries of all rows.
    pub fn entries(&self) -> u64 {
        self.ends.len() as u64
    }
}
