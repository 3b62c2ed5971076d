//! From pairs that see each other to rows.

use nestrad_proto::v1;

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

/// Sorts pairs into rows, stably: by counting, so the cost is linear.
pub(crate) fn collect(block: &Block, traced: &Traced) -> v1::Rows {
    let mut lengths = vec![0u32; block.rows];
    let mut count = |local: u32| {
        if let Some(row) = block.row_of(local) {
            lengths[row] += 1;
        }
    };
    for &(a, b) in traced.pairs.iter().flatten() {
        count(a);
        count(b);
    }
    for &(a, _) in &traced.looks {
        count(a);
    }

    let mut next = Vec::with_capacity(block.rows);
    let mut total = 0usize;
    for &length in &lengths {
        next.push(total);
        total += length as usize;
    }
    let mut ends = vec![0u32; total];
    let mut put = |from: u32, seen: u32| {
        if let Some(row) = block.row_of(from) {
            ends[next[row]] = block.global(seen);
            next[row] += 1;
        }
    };
    for &(a, b) in traced.pairs.iter().flatten() {
        put(a, b);
        put(b, a);
    }
    for &(a, b) in &traced.looks {
        put(a, b);
    }
    v1::Rows {
        lengths,
        ends,
        lines: traced.lines,
        segments: traced.pairs.iter().map(|p| p.len() as u64).sum(),
        rays: traced.rays,
    }
}
