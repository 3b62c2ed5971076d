//! Parallel lines: along each direction the block is scanned on a lattice, the hits of a line are
//! sorted by depth, and neighbours along it see each other (DESIGN: section 4).

mod fragments;
mod sight;

use glam::DVec3;
use nestrad_common::lattice::Lattice;
use nestrad_proto::v1;
use rayon::prelude::*;

use crate::block::Block;
use crate::rows::{Pair, Traced};

/// Traces the lines of a batch; directions in parallel, each on its own.
pub(crate) fn trace(block: &Block, batch: &v1::Batch) -> Traced {
    let (lines, pairs): (Vec<u64>, Vec<Vec<Pair>>) = batch
        .lines
        .par_iter()
        .map(|lines| direction(block, batch.line_area_m2, lines))
        .unzip();
    Traced {
        pairs,
        lines: lines.iter().sum(),
        ..Traced::default()
    }
}

fn direction(block: &Block, line_area_m2: f64, lines: &v1::Lines) -> (u64, Vec<Pair>) {
    let Some(d) = &lines.direction else {
        return (0, Vec::new());
    };
    let random = [lines.random_x, lines.random_y, lines.random_count];
    let lattice = Lattice::new(
        DVec3::new(d.x, d.y, d.z),
        &block.extent,
        line_area_m2,
        random,
    );
    let mut pairs = Vec::new();
    if lattice.lines() > 0 {
        let sight = sight::Sight::new(block, &lattice);
        fragments::for_each_line(block, &lattice, |line, hits| {
            sight.along(line, hits, &mut pairs)
        });
    }
    (lattice.lines() as u64, pairs)
}
