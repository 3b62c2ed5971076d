//! What is buried in something solid.
//!
//! The bases of leaves stick in their stem. A line that enters a solid through its surface and leaves it
//! again passes, in between, what is buried there: that gets and gives no light. Without that, an element
//! that sticks halfway in a stem would carry light from its lit half into the stem. A line that meets the
//! inside of a solid from one side only has come through an opening, and is a line like any other.
//!
//! Both ends of what is buried lie within the sphere's radius of each other: so a block with all that is
//! within that radius of what it owns finds the same as the whole scene does.

use super::fragments::Hit;
use crate::block::Block;
use crate::rows::Pair;

/// Takes the light away from what is buried along one line, whose pairs stand in order from `start`: one
/// up to each hit, or two, from below and from the hit, where these are too far apart. `longest` is how
/// many steps may lie between the ends of what is buried.
pub(crate) fn bury(
    block: &Block,
    hits: &[Hit],
    longest: Option<u32>,
    line: &mut Vec<Pair>,
    start: usize,
) {
    let (buried, dark) = (
        block.local(block.ends.buried()),
        block.local(block.ends.void()),
    );
    // what a face is told to see when it is inside
    let told = |face: u32| if block.is_inside(face) { dark } else { buried };
    let (mut entered, mut depth) = (None, 0);
    let (mut next, mut in_gap) = (hits.iter(), false);
    for k in start..line.len() {
        let (from, to) = line[k];
        if block.is_inside(from) {
            entered = Some((k, depth));
        }
        let near = block.is_face(to);
        if near || in_gap {
            depth = next.next().map_or(depth, |hit| hit.depth());
        }
        in_gap = !near && !in_gap;
        if !near {
            // through an opening, or farther than the near field reaches
            entered = None;
        } else if block.is_inside(to)
            && let Some((first, entry)) = entered.take()
            && first < k
            && longest.is_none_or(|steps| depth - entry <= steps)
        {
            for inside in first..=k {
                let (a, b) = line[inside];
                line[inside] = (a, told(a));
                line.push((b, told(b)));
            }
        }
    }
}
