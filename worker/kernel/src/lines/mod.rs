//! Parallel lines: along each direction the block is scanned on a lattice, the hits of a line are
//! sorted by depth, and neighbours along it see each other (DESIGN: section 4).

mod burial;
mod fragments;
mod sight;

use rayon::prelude::*;

use crate::block::Block;
use crate::job::{Batch, Lines};
use crate::lattice::Lattice;
use crate::part::Part;
use crate::rows::{Pair, Seen};
pub(crate) use fragments::rows_of;
pub(crate) use sight::LinesOnSoil;
use sight::Sight;

/// Directions that are drawn together: more would save little, and their fragments take memory.
const DRAWN_TOGETHER: usize = 4;

/// Traces the lines of a batch; groups of directions in parallel, each on its own.
pub(crate) fn trace(block: &Block, batch: &Batch) -> Seen {
    let (lines, pairs): (Vec<u64>, Vec<Vec<Vec<Pair>>>) = batch
        .lines
        .par_chunks(DRAWN_TOGETHER)
        .map(|group| seen_along(block, group))
        .unzip();
    Seen {
        pairs: pairs.into_iter().flatten().collect(),
        lines: lines.iter().sum(),
        ..Seen::default()
    }
}

/// The number of lines along some directions, and along each direction the pairs that see each other.
fn seen_along(block: &Block, group: &[Lines]) -> (u64, Vec<Vec<Pair>>) {
    let (lattices, parts) = lattices(block, group);
    let sights: Vec<Sight> = lattices.iter().map(|l| Sight::new(block, l)).collect();
    let mut pairs = vec![Vec::new(); lattices.len()];
    let lines = fragments::for_each_line(block, &lattices, &parts, |k, line, hits| {
        sights[k].along(line, hits, &mut pairs[k]);
    });
    (lines.iter().sum(), pairs)
}

/// The pairs that see each other along the lines of one row of a lattice of a batch, which `number` chooses.
pub(crate) fn of_one_row(block: &Block, batch: &Batch, number: u64) -> Vec<Pair> {
    let mut pairs = Vec::new();
    let (lattices, parts) = lattices(block, &batch.lines);
    let pick = |bits: u64, of: u64| (bits as u32 as u64 * of) >> 32;
    let k = pick(number, lattices.len() as u64) as usize;
    if let Some((lattice, &part)) = lattices.get(k).zip(parts.get(k)) {
        let rows = rows_of(lattice, part);
        let row = rows.start + pick(number >> 32, rows.len() as u64) as u32;
        if rows.contains(&row) {
            let sight = Sight::new(block, lattice);
            fragments::for_each_line_of_row(block, lattice, row, |line, hits| {
                sight.along(line, hits, &mut pairs);
            });
        }
    }
    pairs
}

/// What stands at the other end of the looks into the far field, along the lines of a batch: (far end, what
/// is there), by direction and line; past the last end, what leaves upwards and downwards.
pub(crate) fn beyond_sphere(block: &Block, batch: &Batch) -> Vec<Pair> {
    let of_group = |group: &[Lines]| {
        let (lattices, parts) = lattices(block, group);
        let sights: Vec<Sight> = lattices.iter().map(|l| Sight::new(block, l)).collect();
        let mut looks = vec![Vec::new(); lattices.len()];
        fragments::for_each_line(block, &lattices, &parts, |k, line, hits| {
            sights[k].beyond(line, hits, &mut looks[k]);
        });
        looks.concat()
    };
    batch
        .lines
        .par_chunks(DRAWN_TOGETHER)
        .map(of_group)
        .collect::<Vec<_>>()
        .concat()
}

/// The lattices that have any lines, and which part of each is asked for.
pub(crate) fn lattices(block: &Block, group: &[Lines]) -> (Vec<Lattice>, Vec<Part>) {
    group
        .iter()
        .filter_map(|lines| {
            let (area_m2, random) = (lines.line_area_m2, lines.random);
            let lattice = Lattice::new(lines.direction, &block.extent, area_m2, random);
            (lattice.lines() > 0).then_some((lattice, lines.part))
        })
        .unzip()
}
