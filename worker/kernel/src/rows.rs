//! From pairs that see each other to rows.
//!
//! What a row sees stands by rising number: the order in which lines were traced, or jobs came in, leaves
//! no mark.

use std::ops::{AddAssign, Range};

use rayon::prelude::*;

use crate::block::Block;
use crate::far_grid::Exit;
use crate::packed::Packer;

/// Two local ends that see each other: what either of them sees is the other.
pub(crate) type Pair = (u32, u32);

/// What the kernel did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counts {
    /// Parallel lines through the scene.
    pub lines: u64,
    /// Pairs of faces that see each other along a line.
    pub segments: u64,
    /// Rays from faces.
    pub rays: u64,
    /// Entries of all rows.
    pub row_entries: u64,
}

impl AddAssign for Counts {
    fn add_assign(&mut self, more: Self) {
        self.lines += more.lines;
        self.segments += more.segments;
        self.rays += more.rays;
        self.row_entries += more.row_entries;
    }
}

/// What the faces of a block see: for each row, one end per line or ray, all of equal weight.
///
/// Rows: upper and lower face of each element of the owned triangles, in order; then the owned soil cells.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rows {
    /// Number of ends of each row.
    pub lengths: Vec<u32>,
    /// The ends of all rows, one row after the other; those of a row by rising number.
    pub ends: Vec<u32>,
    /// What it took.
    pub counts: Counts,
}

/// The same rows as they travel and are kept.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PackedRows {
    /// See [`crate::packed`].
    pub packed: Vec<u8>,
    /// What it took.
    pub counts: Counts,
}

/// What the lines and rays of a job found, before it is sorted into rows.
#[derive(Default)]
pub struct Seen {
    /// Each pair serves both its ends.
    pub(crate) pairs: Vec<Vec<Pair>>,
    /// What rays saw: (who looks, what it sees), the second one does not see back.
    pub(crate) looks: Vec<Pair>,
    pub(crate) lines: u64,
    pub(crate) rays: u64,
}

impl Seen {
    fn counts(&self, row_entries: u64) -> Counts {
        Counts {
            lines: self.lines,
            segments: self.pairs.iter().map(|p| p.len() as u64).sum(),
            rays: self.rays,
            row_entries,
        }
    }

    /// The rows of the block that it was found in.
    ///
    /// Pairs are sorted first into runs of rows, then by counting within each run, so that neither reaches
    /// over more memory than a cache holds; then each row. What has been read is freed: a batch of a large scene
    /// is hundreds of MB.
    pub fn rows(self, block: &Block) -> Rows {
        let count = block.rows().div_ceil(SORTED_TOGETHER);
        let mut counts = self.counts(0);
        let entries = 2 * counts.segments as usize + self.looks.len();
        // most runs have as many, give or take a quarter
        let room = entries / count.max(1) / 4 * 5;
        let mut runs: Vec<Vec<Pair>> = Vec::new();
        runs.resize_with(count, || Vec::with_capacity(room));
        let mut put = |from: u32, seen: u32| {
            if let Some(row) = block.row_of(from) {
                runs[row as usize / SORTED_TOGETHER].push((row, block.number_of(seen)));
            }
        };
        for pairs in self.pairs {
            for (a, b) in pairs {
                put(a, b);
                put(b, a);
            }
        }
        for (a, b) in self.looks {
            put(a, b);
        }
        let (lengths, ends): (Vec<Vec<u32>>, Vec<Vec<u32>>) = runs
            .into_par_iter()
            .enumerate()
            .map(|(run, entries)| {
                let first = run * SORTED_TOGETHER;
                sorted_by_row(&entries, first..(first + SORTED_TOGETHER).min(block.rows()))
            })
            .unzip();
        let mut all = Vec::with_capacity(ends.iter().map(Vec::len).sum());
        for ends in ends {
            all.extend_from_slice(&ends);
        }
        counts.row_entries = all.len() as u64;
        Rows {
            lengths: lengths.concat(),
            ends: all,
            counts,
        }
    }

    /// The same rows, packed.
    pub fn packed(&self, block: &Block) -> PackedRows {
        let (mut mutual, mut single) = (Runs::new(block.rows()), Runs::new(block.rows()));
        for &(a, b) in self.pairs.iter().flatten() {
            match (block.row_of(a), block.row_of(b)) {
                (Some(a), Some(b)) => mutual.push((a.max(b), a.min(b))),
                (Some(row), None) => single.push((row, block.number_of(b))),
                (None, Some(row)) => single.push((row, block.number_of(a))),
                (None, None) => {}
            }
        }
        for &(a, b) in &self.looks {
            if let Some(row) = block.row_of(a) {
                single.push((row, block.number_of(b)));
            }
        }
        let mut packer = Packer::new(block.ends());
        mutual.for_each(|(row, other)| packer.mutual(row, other));
        single.for_each(|(row, end)| packer.single(row, end));
        let counts = self.counts(packer.entries());
        PackedRows {
            packed: packer.finish(),
            counts,
        }
    }
}

/// Rows that are sorted together: their counters fit a first-level cache.
const SORTED_TOGETHER: usize = 1 << 13;

/// Lengths of some rows, and what they see, from (row, what it sees).
fn sorted_by_row(entries: &[Pair], rows: Range<usize>) -> (Vec<u32>, Vec<u32>) {
    let mut lengths = vec![0u32; rows.len()];
    for &(row, _) in entries {
        lengths[row as usize - rows.start] += 1;
    }
    let mut total = 0;
    let mut next: Vec<u32> = lengths
        .iter()
        .map(|l| {
            total += l;
            total - l
        })
        .collect();
    let mut ends = vec![0; entries.len()];
    for &(row, seen) in entries {
        let place = &mut next[row as usize - rows.start];
        ends[*place as usize] = seen;
        *place += 1;
    }
    let mut rest = &mut ends[..];
    for &length in &lengths {
        let (row, left) = rest.split_at_mut(length as usize);
        row.sort_unstable();
        rest = left;
    }
    (lengths, ends)
}

/// Pairs of a row and what it sees, in runs of rows that are sorted together.
struct Runs(Vec<Vec<u64>>);

impl Runs {
    fn new(rows: usize) -> Self {
        Self(vec![Vec::new(); rows.div_ceil(SORTED_TOGETHER)])
    }

    fn push(&mut self, (row, seen): Pair) {
        let key = u64::from(row) << 32 | u64::from(!seen);
        self.0[row as usize / SORTED_TOGETHER].push(key);
    }

    /// By rising row, within a row by falling number of what it sees.
    fn for_each(self, mut pair: impl FnMut(Pair)) {
        for mut run in self.0 {
            run.sort_unstable();
            for key in run {
                pair(((key >> 32) as u32, !(key as u32)));
            }
        }
    }
}

/// Sorts looks into rows of the far ends and of the ways out.
pub(crate) fn of_far_field(block: &Block, looks: &[Pair]) -> Rows {
    let (first, far_ends) = (block.local(block.ends.far(0)), block.ends.far_ends);
    let entries: Vec<Pair> = looks
        .iter()
        .map(|&(from, seen)| (from - first, block.number_of(seen)))
        .collect();
    let rows = far_ends as usize + Exit::BOTH.len();
    let (lengths, ends) = sorted_by_row(&entries, 0..rows);
    Rows {
        lengths,
        ends,
        counts: Counts::default(),
    }
}
