//! What is buried in something solid.
//!
//! The bases of leaves stick in their stem. A line that enters a solid through its surface and leaves it
//! again passes, in between, what is buried there: that gets and gives no light. Without that, an element
//! that sticks halfway in a stem would carry light from its lit half into the stem. A line that meets the
//! inside of a solid from one side only has come through an opening, and is a line like any other.

use crate::block::Block;
use crate::rows::Pair;

/// Takes the light away from what is buried along one line, whose pairs stand in order.
pub(crate) fn bury(block: &Block, line: &mut Vec<Pair>, start: usize) {
    let (buried, dark) = (
        block.local(block.ends.buried()),
        block.local(block.ends.void()),
    );
    // what a face is told to see when it is inside
    let told = |face: u32| if block.is_inside(face) { dark } else { buried };
    let mut entered: Option<usize> = None;
    for k in start..line.len() {
        let (from, to) = line[k];
        if block.is_inside(from) {
            entered = Some(k);
        }
        if to >= block.local_faces {
            // through an opening, or farther than the near field reaches
            entered = None;
        } else if block.is_inside(to)
            && let Some(first) = entered.take()
            && first < k
        {
            for inside in first..=k {
                let (a, b) = line[inside];
                line[inside] = (a, told(a));
                line.push((b, told(b)));
            }
        }
    }
}
