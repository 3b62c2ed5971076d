//! Cells of the soil, and zones around them, put together by four: what the solution would be made of if they were
//! twice as wide.

use crate::frame::Frame;

/// Which of the soil shares one radiosity when cells are twice as wide. Cells can be paired in two ways, and one of
/// them may by chance say nothing of an edge between light and shade.
#[derive(Clone, Debug, Default)]
pub(super) struct SoilGroups {
    /// In either way.
    pub(super) ways: [Vec<Member>; 2],
    /// Groups of either way, at most.
    pub(super) len: usize,
}

/// A cell, or a zone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    pub(super) end: u32,
    pub(super) group: u32,
    pub(super) area_m2: f64,
}

impl SoilGroups {
    pub(super) fn of(frame: &Frame) -> Self {
        let mut groups = Self::default();
        let ends = &frame.ends;
        if let Some(soil) = &frame.world.soil {
            let area_m2 = |_| soil.cell_area_m2();
            groups.add(soil.cells, |cell| ends.soil(cell), area_m2);
        }
        if let Some(outer) = &frame.world.outer_soil() {
            let area_m2 = |zone| outer.area_m2(zone);
            groups.add(outer.sides(), |zone| ends.zone(zone), area_m2);
        }
        groups
    }

    fn add(&mut self, [nx, ny]: [u32; 2], end: impl Fn(u32) -> u32, area_m2: impl Fn(u32) -> f64) {
        let [wide, high] = [nx, ny].map(|n| n / 2 + 1);
        for (way, shift) in self.ways.iter_mut().zip(0..) {
            way.extend((0..nx * ny).map(|k| Member {
                end: end(k),
                group: self.len as u32 + (k / nx + shift) / 2 * wide + (k % nx + shift) / 2,
                area_m2: area_m2(k),
            }));
        }
        self.len += (wide * high) as usize;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_share_a_group_in_one_way_or_the_other() {
        for sides in [[1, 1], [4, 6], [5, 3]] {
            let mut groups = SoilGroups::default();
            groups.add(sides, |k| k, |_| 1.0);
            let group =
                |way: usize, x: u32, y: u32| groups.ways[way][(y * sides[0] + x) as usize].group;
            for way in &groups.ways {
                assert!(way.iter().all(|m| (m.group as usize) < groups.len));
            }
            for y in 0..sides[1] {
                for x in 1..sides[0] {
                    let together = |way: usize| group(way, x - 1, y) == group(way, x, y);
                    assert_ne!(together(0), together(1));
                }
            }
        }
    }
}
