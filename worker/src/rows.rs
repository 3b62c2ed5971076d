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
    // what has no row is counted past the last one, so that counting needs no branch
    let row = |local: u32| block.row[local as usize] as usize;
    let mut next = vec![0u32; block.rows + 1];
    for &(a, b) in traced.pairs.iter().flatten() {
        next[row(a)] += 1;
        next[row(b)] += 1;
    }
    for &(a, _) in &traced.looks {
        next[row(a)] += 1;
    }
    let lengths = next[..block.rows].to_vec();
    let mut total = 0;
    for place in &mut next {
        total += std::mem::replace(place, total);
    }
    let mut ends = vec![0u32; total as usize];
    let mut put = |from: u32, seen: u32| {
        let place = &mut next[row(from)];
        ends[*place as usize] = block.seen_as[seen as usize];
        *place += 1;
    };
    for &(a, b) in traced.pairs.iter().flatten() {
        put(a, b);
        put(b, a);
    }
    for &(a, b) in &traced.looks {
        put(a, b);
    }
    ends.truncate(lengths.iter().map(|&l| l as usize).sum());
    v1::Rows {
        lengths,
        ends,
        lines: traced.lines,
        segments: traced.pairs.iter().map(|p| p.len() as u64).sum(),
        rays: traced.rays,
    }
}

/// Sorts looks into rows of the far ends and of the two ways out.
pub(crate) fn of_far_field(block: &Block, looks: &[Pair]) -> v1::Rows {
    let first = block.local(block.ends.far_start());
    let mut rows = v1::Rows {
        lengths: vec![0; block.ends.far_len() as usize + 2],
        ..v1::Rows::default()
    };
    for &(from, _) in looks {
        rows.lengths[(from - first) as usize] += 1;
    }
    let mut total = 0;
    let mut next: Vec<usize> = rows
        .lengths
        .iter()
        .map(|&l| {
            total += l as usize;
            total - l as usize
        })
        .collect();
    rows.ends = vec![0; total];
    for &(from, seen) in looks {
        let place = &mut next[(from - first) as usize];
        rows.ends[*place] = block.seen_as[seen as usize];
        *place += 1;
    }
    rows
}
