//! Parallel lines: along each direction the block is scanned on a lattice, the hits of a line are
//! sorted by depth, and neighbours along it see each other (DESIGN: section 4).

mod burial;
mod fragments;
mod sight;

use glam::DVec3;
use nestrad_common::lattice::Lattice;
use nestrad_proto::v1;
use rayon::prelude::*;

use crate::block::Block;
use crate::part::Part;
use crate::rows::{Pair, Traced};

/// Traces the lines of a batch; directions in parallel, each on its own.
pub(crate) fn trace(block: &Block, batch: &v1::Batch) -> Traced {
    let (lines, pairs): (Vec<u64>, Vec<Vec<Pair>>) = batch
        .lines
        .par_iter()
        .map(|lines| direction(block, lines))
        .unzip();
    Traced {
        pairs,
        lines: lines.iter().sum(),
        ..Traced::default()
    }
}

/// What stands at the other end of the looks into the far field, along the lines of a batch: (far end, what
/// is there), by direction and line; past the last end, what leaves upwards and downwards.
pub(crate) fn beyond_sphere(block: &Block, batch: &v1::Batch) -> Vec<Pair> {
    let of_direction = |lines: &v1::Lines| {
        let mut looks = Vec::new();
        if let Some(lattice) = lattice(block, lines).filter(|l| l.lines() > 0) {
            let sight = sight::Sight::new(block, &lattice);
            fragments::for_each_line(block, &lattice, part(lines), |line, hits| {
                sight.beyond(line, hits, &mut looks);
            });
        }
        looks
    };
    batch
        .lines
        .par_iter()
        .map(of_direction)
        .collect::<Vec<_>>()
        .concat()
}

fn lattice(block: &Block, lines: &v1::Lines) -> Option<Lattice> {
    let d = lines.direction.as_ref()?;
    let random = [lines.random_x, lines.random_y, lines.random_count];
    Some(Lattice::new(
        DVec3::new(d.x, d.y, d.z),
        &block.extent,
        lines.line_area_m2,
        random,
    ))
}

fn part(lines: &v1::Lines) -> Part {
    Part::new(lines.part, lines.parts)
}

fn direction(block: &Block, lines: &v1::Lines) -> (u64, Vec<Pair>) {
    let mut pairs = Vec::new();
    let Some(lattice) = lattice(block, lines).filter(|l| l.lines() > 0) else {
        return (0, pairs);
    };
    let sight = sight::Sight::new(block, &lattice);
    let traced = fragments::for_each_line(block, &lattice, part(lines), |line, hits| {
        sight.along(line, hits, &mut pairs)
    });
    (traced, pairs)
}
