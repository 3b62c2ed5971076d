//! Radiosities as they were if elements, or cells of the soil, were larger.

use super::groups::Groups;
use super::soil_groups::Member;

impl Groups {
    /// How much wider larger elements are; 1 where there are none.
    pub fn wider(&self) -> f64 {
        self.wider
    }

    /// Radiosities by end, those of the faces of a group replaced by their mean; `area_m2` is what counts of a row.
    pub fn of_larger_elements(
        &self,
        area_m2: impl Fn(usize) -> f64,
        radiosity: &[f64],
    ) -> Vec<f64> {
        let faces = (0..).zip(&self.of_face).map(|(end, &group)| Member {
            end,
            group,
            area_m2: area_m2(end as usize),
        });
        evened(faces, self.len, radiosity)
    }

    /// The same of cells of the soil and zones around them, in either way of putting them together.
    pub fn of_larger_cells(&self, radiosity: &[f64]) -> [Vec<f64>; 2] {
        let ways = self.soil.ways.each_ref();
        ways.map(|way| evened(way.iter().copied(), self.soil.len, radiosity))
    }
}

fn evened(
    members: impl Iterator<Item = Member> + Clone,
    groups: usize,
    radiosity: &[f64],
) -> Vec<f64> {
    let mut sums = vec![[0.0; 2]; groups];
    for member in members.clone() {
        let [sum, area] = &mut sums[member.group as usize];
        *sum += member.area_m2 * radiosity[member.end as usize];
        *area += member.area_m2;
    }
    let mut evened = radiosity.to_vec();
    for member in members {
        let [sum, area] = sums[member.group as usize];
        if area > 0.0 && member.area_m2 > 0.0 {
            evened[member.end as usize] = sum / area;
        }
    }
    evened
}
