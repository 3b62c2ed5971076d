//! From pairs that see each other to rows.

use std::ops::Range;

use nestrad_proto::v1;
use rayon::prelude::*;

use crate::block::Block;

/// Two local ends that see each other: what either of them sees is the other.
pub(crate) type Pair = (u32, u32);

/// What one batch found, before it is sorted into rows.
#[derive(Default)]
pub(crate) struct Traced {
    /// Each pair serves both its ends; in the order of directions, then of lines, then along a line.
    pub(crate) pairs: Vec<Vec<Pair>>,
    /// What rays saw: (who looks, what it sees), the second one does not see back.
    pub(crate) looks: Vec<Pair>,
    pub(crate) lines: u64,
    pub(crate) rays: u64,
}

/// Rows that are sorted together: their counters fit a first-level cache.
const SORTED_TOGETHER: usize = 1 << 13;

/// Sorts pairs into rows, stably, at a cost that is linear: first into runs of rows, then by counting
/// within each run, so that neither reaches over more memory than a cache holds.
pub(crate) fn collect(block: &Block, traced: &Traced) -> v1::Rows {
    let mut runs: Vec<Vec<Pair>> = vec![Vec::new(); block.rows.div_ceil(SORTED_TOGETHER)];
    let mut put = |from: u32, seen: u32| {
        if let Some(entry) = block.entry(from, seen) {
            runs[entry.0 as usize / SORTED_TOGETHER].push(entry);
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
            sorted_by_row(&entries, first..(first + SORTED_TOGETHER).min(block.rows))
        })
        .unzip();
    v1::Rows {
        lengths: lengths.concat(),
        ends: ends.concat(),
        lines: traced.lines,
        segments: traced.pairs.iter().map(|p| p.len() as u64).sum(),
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
    (lengths, ends)
}

/// Sorts looks into rows of the far ends and of the two ways out.
pub(crate) fn of_far_field(block: &Block, looks: &[Pair]) -> v1::Rows {
    let first = block.local(block.ends.far_start());
    let entries: Vec<Pair> = looks
        .iter()
        .map(|&(from, seen)| (from - first, block.seen_as[seen as usize]))
        .collect();
    let (lengths, ends) = sorted_by_row(&entries, 0..block.ends.far_len() as usize + 2);
    v1::Rows {
        lengths,
        ends,
        ..v1::Rows::default()
    }
}
