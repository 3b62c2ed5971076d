//! Rows of the exchange: of a batch, of a half.

use std::ops::Range;

use rayon::prelude::*;

use crate::heap;

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

/// The rows of all batches of a half, joined: a pass reads each row as one list.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HalfRows {
    /// Number of batches.
    batches: usize,
    /// Start of each row in `ends`, and the length of `ends` at the end.
    start: Vec<u64>,
    /// Where the entries of each batch end in a row, from the row's start: `row * batches + batch`.
    batch_end: BatchEnds,
    /// What is seen, one entry per line or ray; by row, then by batch.
    ends: Vec<u32>,
}

/// Places within a row. Rows are short, and there are millions.
#[derive(Clone, Debug, PartialEq)]
enum BatchEnds {
    /// No row has more than 65,535 entries.
    Short(Vec<u16>),
    /// One has.
    Long(Vec<u32>),
}

impl Default for BatchEnds {
    fn default() -> Self {
        Self::Short(Vec::new())
    }
}

impl BatchEnds {
    /// Of batches of so many rows.
    fn of(batches: &[BatchRows], rows: usize) -> Self {
        let ends = (0..rows).flat_map(|row| {
            batches.iter().scan(0, move |end, batch| {
                *end += batch.start[row + 1] - batch.start[row];
                Some(*end)
            })
        });
        let mut short = Vec::with_capacity(rows * batches.len());
        for end in ends.clone() {
            match u16::try_from(end) {
                Ok(end) => short.push(end),
                Err(_) => return Self::Long(ends.collect()),
            }
        }
        Self::Short(short)
    }

    #[inline]
    fn at(&self, place: usize) -> usize {
        match self {
            Self::Short(ends) => usize::from(ends[place]),
            Self::Long(ends) => ends[place] as usize,
        }
    }
}

/// Rows that are joined as one task.
const JOINED_AT_ONCE: usize = 4096;

/// The first numbers of a slice, which is left without them.
fn take_front<'a>(slice: &mut &'a mut [u32], count: usize) -> &'a mut [u32] {
    let (front, rest) = std::mem::take(slice).split_at_mut(count);
    *slice = rest;
    front
}

impl HalfRows {
    /// Joins the batches of a half, which give their memory back as they are read: entries are never there twice.
    pub fn join(mut batches: Vec<BatchRows>) -> Self {
        let count = batches.len();
        let rows = batches.first().map_or(0, |b| b.start.len() - 1);
        let batch_end = BatchEnds::of(&batches, rows);
        let mut start = Vec::with_capacity(rows + 1);
        start.push(0);
        let mut total = 0;
        for row in 0..rows {
            total += batches.iter().map(|b| b.row(row).len()).sum::<usize>() as u64;
            start.push(total);
        }
        // memory that the system gives when it is written to
        let mut ends = vec![0; total as usize];
        let (starts, mut left): (Vec<&[u32]>, Vec<&mut [u32]>) = batches
            .iter_mut()
            .map(|b| (&b.start[..], &mut b.ends[..]))
            .unzip();
        let mut parts = Vec::with_capacity(rows.div_ceil(JOINED_AT_ONCE));
        let mut rest = &mut ends[..];
        for first in (0..rows).step_by(JOINED_AT_ONCE) {
            let last = (first + JOINED_AT_ONCE).min(rows);
            let into = take_front(&mut rest, (start[last] - start[first]) as usize);
            let from: Vec<&mut [u32]> = starts
                .iter()
                .zip(&mut left)
                .map(|(start, left)| take_front(left, (start[last] - start[first]) as usize))
                .collect();
            parts.push((first..last, into, from));
        }
        parts.into_par_iter().for_each(|(rows, mut part, from)| {
            let first = rows.start;
            for row in rows {
                for (start, from) in starts.iter().zip(&from) {
                    let [begin, end] = [row, row + 1].map(|r| (start[r] - start[first]) as usize);
                    take_front(&mut part, end - begin).copy_from_slice(&from[begin..end]);
                }
            }
            from.into_iter().for_each(heap::forget);
        });
        Self {
            batches: count,
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
        let first = row * self.batches;
        let mut last = start;
        (first..first + self.batches).map(move |place| {
            let from = last;
            last = start + self.batch_end.at(place);
            from..last
        })
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let of_places = match &self.batch_end {
            BatchEnds::Short(ends) => size_of_val(&ends[..]),
            BatchEnds::Long(ends) => size_of_val(&ends[..]),
        };
        (of_places + size_of_val(&self.start[..]) + size_of_val(&self.ends[..])) as u64
    }

    /// Number of entries of all rows.
    pub fn entries(&self) -> u64 {
        self.ends.len() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_joined_batch_by_batch_however_long_they_are() {
        for long in [2, 70_000] {
            let batches = [
                BatchRows::new(&[2, long], (0..2 + long).collect()),
                BatchRows::new(&[0, 1], vec![7]),
            ];
            let joined = HalfRows::join(batches.to_vec());
            assert_eq!(
                joined.batch_end,
                match long {
                    2 => BatchEnds::Short(vec![2, 2, 2, 3]),
                    _ => BatchEnds::Long(vec![2, 2, long, long + 1]),
                }
            );
            let at = 2 + long as usize;
            assert!(joined.by_batch(0).eq([0..2, 2..2]));
            assert!(joined.by_batch(1).eq([2..at, at..at + 1]));
            assert_eq!(joined.ends()[at], 7);
        }
    }
}
