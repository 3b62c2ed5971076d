//! The boxes that the tree is built over.

use glam::{DVec2, DVec3};
use nestrad_common::geometry;
use obvhs::aabb::Aabb;

use crate::block::Block;

/// A copy of the scene: how many patterns it lies away in x and y.
pub(super) type Shift = [i64; 2];

/// Boxes, no two of them the same, with the triangles in each. Many triangles in one place would make a
/// tree deeper than obvhs can walk.
#[derive(Default)]
pub(super) struct Boxes {
    pub(super) boxes: Vec<Aabb>,
    /// Where the list of each box starts in `members`, and their number at the end.
    pub(super) first_member: Vec<u32>,
    /// Local triangles and copies of them.
    pub(super) members: Vec<(u32, Shift)>,
}

impl Boxes {
    /// Of the triangles that `keep` holds of and, with a pattern, of those copies of them that reach into it.
    /// `tree` takes points to the units of the tree, in which boxes are padded.
    pub(super) fn of(
        block: &Block,
        keep: impl Fn(usize) -> bool,
        tree: impl Fn(DVec3) -> DVec3,
        padding: f64,
    ) -> Self {
        let mut all = Vec::with_capacity(block.soup.len());
        for (t, triangle) in block.soup.triangles().enumerate() {
            // what has no area is never met
            if !keep(t) || geometry::area(&triangle) == 0.0 {
                continue;
            }
            let Some((a, b)) = geometry::bounds(&triangle) else {
                continue;
            };
            for shift in copies(block, a.truncate(), b.truncate()) {
                let by = block.shift_m(shift);
                let aabb = Aabb {
                    min: (tree(a + by) - padding).as_vec3a(),
                    max: (tree(b + by) + padding).as_vec3a(),
                };
                all.push((aabb, (t as u32, shift)));
            }
        }
        all.sort_by_cached_key(|(aabb, place)| (bits(aabb), *place));
        let mut grouped = Self::default();
        for (aabb, place) in all {
            if grouped
                .boxes
                .last()
                .is_none_or(|last| bits(last) != bits(&aabb))
            {
                grouped.boxes.push(aabb);
                grouped.first_member.push(grouped.members.len() as u32);
            }
            grouped.members.push(place);
        }
        grouped.first_member.push(grouped.members.len() as u32);
        grouped
    }
}

fn bits(aabb: &Aabb) -> [[u32; 3]; 2] {
    [aabb.min.to_array(), aabb.max.to_array()].map(|corner| corner.map(f32::to_bits))
}

/// Shifts by whole patterns that bring the box `a..b` into the pattern.
fn copies(block: &Block, a: DVec2, b: DVec2) -> Vec<Shift> {
    let extent = &block.extent;
    if !extent.periodic {
        return vec![[0, 0]];
    }
    let (min, max) = (extent.min_m.truncate(), extent.max_m.truncate());
    let size = max - min;
    let (first, last) = (((min - b) / size).ceil(), ((max - a) / size).floor());
    let mut shifts = Vec::new();
    for i in first.x as i64..=last.x as i64 {
        for j in first.y as i64..=last.y as i64 {
            shifts.push([i, j]);
        }
    }
    shifts
}
