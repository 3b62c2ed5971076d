//! What is seen from the levels of the far field.

use nestrad_common::lattice::{DEPTH_OF_TOP, Lattice};

use super::fragments::Hit;
use super::sight::SoilUnder;
use crate::block::Block;
use crate::rows::Pair;

/// Looks up and down from each level along a line.
pub(crate) struct Levels<'a> {
    block: &'a Block,
    soil: Option<SoilUnder>,
    bin: u32,
    depth: Vec<u32>,
}

impl<'a> Levels<'a> {
    pub(crate) fn new(block: &'a Block, lattice: &Lattice) -> Self {
        let ends = &block.ends;
        let last = f64::from(ends.far_levels.saturating_sub(1).max(1));
        Self {
            block,
            soil: block.soil.map(|soil| SoilUnder::new(&soil, lattice)),
            bin: ends.far_bin(lattice.direction.z),
            depth: (0..ends.far_levels)
                .map(|l| (f64::from(l) / last * f64::from(DEPTH_OF_TOP)) as u32)
                .collect(),
        }
    }

    /// Adds what one line sees from each level; `hits` by rising depth.
    pub(crate) fn along(&self, line: usize, hits: &[Hit], looks: &mut Vec<Pair>) {
        let (block, ends) = (self.block, &self.block.ends);
        let floor = self.soil.as_ref().map_or(0, SoilUnder::depth);
        let bottom = match &self.soil {
            Some(soil) => soil.cell(line).map_or(ends.outer_soil(), |c| ends.soil(c)),
            None => ends.void(),
        };
        for (level, &depth) in self.depth.iter().enumerate() {
            let level = level as u32;
            // from below the soil only the soil is seen, from either side: it is black there
            if depth < floor {
                looks.push((
                    block.local(ends.far_from_above(self.bin, level)),
                    block.local(ends.void()),
                ));
                looks.push((
                    block.local(ends.far_from_below(self.bin, level)),
                    block.local(ends.void()),
                ));
                continue;
            }
            let above = hits.partition_point(|h| h.depth() < depth);
            let up = hits
                .get(above)
                .map_or(block.local(ends.sky()), |h| h.face_against());
            let below = hits[..above].last().filter(|h| h.depth() >= floor);
            let down = below.map_or(block.local(bottom), |h| h.face_along());
            looks.push((block.local(ends.far_from_above(self.bin, level)), up));
            looks.push((block.local(ends.far_from_below(self.bin, level)), down));
        }
    }
}
