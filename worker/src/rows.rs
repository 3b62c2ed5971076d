//! From pairs that see each other to rows.
//!
//! What a row sees stands by rising number: the order in which lines were traced, or jobs came in, leaves
//! no mark.

use std::ops::Range;

use nestrad_proto::packed::Packer;
use nestrad_proto::v1;
use rayon::prelude::*;

use crate::block::Block;

/// Two local ends that see each other: what either of them sees is the other.
pub(crate) type Pair = (u32, u32);

/// What one batch found, before it is sorted into rows.
#[derive(Default)]
pub(crate) struct Traced {
    /// Each pair serves both its ends.
    pub(crate) pairs: Vec<Vec<Pair>>,
    /// What rays saw: (who looks, what it sees), the second one does not see back.
    pub(crate) looks: Vec<Pair>,
    pub(crate) lines: u64,
    pub(crate) rays: u64,
}

impl Traced {
    /// Segments between hits.
    pub(crate) fn segments(&self) -> u64 {
        self.pairs.iter().map(|p| p.len() as u64).sum()
    }
}

/// Rows that are sorted together: their counters fit a first-level cache.
const SORTED_TOGETHER: usize = 1 << 13;

/// Sorts pairs into rows: first into runs of rows, then by counting within each run, so that neither reaches
/// over more memory than a cache holds; then each row.
pub(crate) fn collect(block: &Block, traced: &Traced) -> v1::Rows {
    let mut runs: Vec<Vec<Pair>> = vec![Vec::new(); block.rows().div_ceil(SORTED_TOGETHER)];
    let mut put = |from: u32, seen: u32| {
        if let Some(row) = block.row_of(from) {
            runs[row as usize / SORTED_TOGETHER].push((row, block.number_of(seen)));
        }
    };
    for &(a, b) in traced.pairs.iter().flatten() {
        put(a, b);
        put(b, a);
    }
    for &(a, b) in &traced.looks {
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
    v1::Rows {
        lengths: lengths.concat(),
        ends: ends.concat(),
        lines: traced.lines,
        segments: traced.segments(),
        rays: traced.rays,
    }
}

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

/// Packs pairs as rows; gives the number of entries, too.
pub(crate) fn pack(block: &Block, traced: &Traced) -> (Vec<u8>, u64) {
    let (mut mutual, mut single) = (Runs::new(block.rows()), Runs::new(block.rows()));
    for &(a, b) in traced.pairs.iter().flatten() {
        match (block.row_of(a), block.row_of(b)) {
            (Some(a), Some(b)) => mutual.push((a.max(b), a.min(b))),
            (Some(row), None) => single.push((row, block.number_of(b))),
            (None, Some(row)) => single.push((row, block.number_of(a))),
            (None, None) => {}
        }
    }
    for &(a, b) in &traced.looks {
        if let Some(row) = block.row_of(a) {
            single.push((row, block.number_of(b)));
        }
    }
    let mut packer = Packer::new(block.ends());
    mutual.for_each(|(row, other)| packer.mutual(row, other));
    single.for_each(|(row, end)| packer.single(row, end));
    let entries = packer.entries();
    (packer.finish(), entries)
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

/// Sorts looks into rows of the far ends and of the two ways out.
pub(crate) fn of_far_field(block: &Block, looks: &[Pair]) -> v1::Rows {
    let first = block.local(block.ends.far_start());
    let entries: Vec<Pair> = looks
        .iter()
        .map(|&(from, seen)| (from - first, block.number_of(seen)))
        .collect();
    let (lengths, ends) = sorted_by_row(&entries, 0..block.ends.far_len() as usize + 2);
    v1::Rows {
        lengths,
        ends,
        ..v1::Rows::default()
    }
}
