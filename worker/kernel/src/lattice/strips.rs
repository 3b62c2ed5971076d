//! The lattice in strips of whole rows, so that what is drawn of a strip stays in the cache.

use std::ops::Range;

use glam::DVec3;

use super::{Lattice, Projected, Soup, scan};
use crate::part::Part;

/// Rows of a lattice in a strip of about so many lines, at least one.
fn rows_in_strip(lattice: &Lattice, lines_in_strip: usize) -> u32 {
    let rows = lines_in_strip / lattice.nx.max(1) as usize;
    rows.clamp(1, lattice.ny.max(1) as usize) as u32
}

/// The rows of a lattice that one of several parts of its strips has.
pub(crate) fn rows_of_part(lattice: &Lattice, lines_in_strip: usize, part: Part) -> Range<u32> {
    let in_strip = rows_in_strip(lattice, lines_in_strip);
    let strips = part.of(lattice.ny.div_ceil(in_strip) as usize);
    let row = |strip: usize| (strip as u32 * in_strip).min(lattice.ny);
    row(strips.start)..row(strips.end)
}

/// Which triangles to draw in which strip.
pub struct Strips<'a> {
    lattice: &'a Lattice,
    soup: &'a Soup,
    rows_in_strip: u32,
    /// Start of each strip's list in `triangles`, and its length at the end; one strip needs no lists.
    start: Vec<usize>,
    triangles: Vec<u32>,
}

impl<'a> Strips<'a> {
    /// Sorts triangles into strips of about `lines_in_strip` lines (at least one row of them).
    pub fn new(lattice: &'a Lattice, soup: &'a Soup, lines_in_strip: usize) -> Self {
        let rows_in_strip = rows_in_strip(lattice, lines_in_strip);
        let mut strips = Self {
            lattice,
            soup,
            rows_in_strip,
            start: Vec::new(),
            triangles: Vec::new(),
        };
        if strips.len() > 1 {
            strips.sort();
        }
        strips
    }

    /// Calls `draw` for each triangle that reaches into a strip, once, by rising number.
    #[inline]
    pub fn for_each(&self, strip: u32, mut draw: impl FnMut(u32, &Projected)) {
        let mut project = |t: u32, triangle: &[DVec3; 3]| {
            if let Some(projected) = Projected::new(self.lattice, triangle) {
                draw(t, &projected);
            }
        };
        if self.start.is_empty() {
            self.soup.for_each_reached(self.lattice, project);
        } else {
            let list = self.start[strip as usize]..self.start[strip as usize + 1];
            for &t in &self.triangles[list] {
                project(t, &self.soup.triangle(t as usize));
            }
        }
    }

    /// Number of strips.
    pub fn len(&self) -> u32 {
        self.lattice.ny.div_ceil(self.rows_in_strip)
    }

    /// A lattice without rows.
    pub fn is_empty(&self) -> bool {
        self.lattice.ny == 0
    }

    /// The lattice rows of a strip.
    pub fn rows(&self, strip: u32) -> Range<u32> {
        strip * self.rows_in_strip..((strip + 1) * self.rows_in_strip).min(self.lattice.ny)
    }

    fn sort(&mut self) {
        let mut members: Vec<(u32, u32)> = Vec::new();
        self.soup.for_each_reached(self.lattice, |t, triangle| {
            let reached = scan::rows(self.lattice, triangle);
            for rows in self.wrapped(&reached).into_iter().flatten() {
                let strips = rows.start / self.rows_in_strip..=(rows.end - 1) / self.rows_in_strip;
                members.extend(strips.map(|s| (s, t)));
            }
        });
        let mut next = vec![0usize; self.len() as usize + 1];
        for &(s, _) in &members {
            next[s as usize + 1] += 1;
        }
        for s in 1..next.len() {
            next[s] += next[s - 1];
        }
        self.start = next.clone();
        self.triangles.resize(members.len(), 0);
        for (s, t) in members {
            self.triangles[next[s as usize]] = t;
            next[s as usize] += 1;
        }
    }

    /// Lattice rows that a triangle reaches: up to two ranges that share no strip.
    fn wrapped(&self, rows: &Range<i64>) -> [Option<Range<u32>>; 2] {
        let ny = i64::from(self.lattice.ny);
        let range = |from: i64, to: i64| (from < to).then_some(from as u32..to as u32);
        if !self.lattice.periodic {
            return [range(rows.start.max(0), rows.end.min(ny)), None];
        }
        if rows.end - rows.start >= ny {
            return [range(0, ny), None];
        }
        let from = rows.start.rem_euclid(ny);
        let to = from + rows.end - rows.start;
        // the part past the seam may come back into the strip where it began: once is enough
        let strip_begin = from - from % i64::from(self.rows_in_strip);
        [
            range(from, to.min(ny)),
            range(0, (to - ny).min(strip_begin)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Extent, Lattice, Soup};
    use super::*;
    use proptest::prelude::*;

    fn hits(lattice: &Lattice, triangles: &[[DVec3; 3]], lines_in_strip: usize) -> Vec<u32> {
        let soup: Soup = triangles.iter().copied().collect();
        let strips = Strips::new(lattice, &soup, lines_in_strip);
        let mut hits = vec![0; lattice.lines()];
        for s in 0..strips.len() {
            strips.for_each(s, |_, p| {
                p.scan(lattice, strips.rows(s), false, |f| hits[f.line] += 1);
            });
        }
        hits
    }

    proptest! {
        #[test]
        fn strips_draw_what_the_whole_lattice_draws(
            corners in proptest::collection::vec((-2.0f64..2.0, -2.0f64..2.0, 0.0f64..1.0), 9),
            z in 0.05f64..1.0, periodic: bool, strip in 1usize..400,
        ) {
            let extent = Extent { min_m: DVec3::ZERO, max_m: DVec3::ONE, periodic };
            let d = DVec3::new((1.0 - z * z).sqrt(), 0.0, z);
            let lattice = Lattice::new(d, &extent, 3e-3, [0.3, 0.6, 0.5]);
            let p: Vec<DVec3> = corners.iter().map(|&(x, y, z)| DVec3::new(x, y, z)).collect();
            let triangles: Vec<[DVec3; 3]> = p.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
            let whole = hits(&lattice, &triangles, usize::MAX);
            prop_assert_eq!(hits(&lattice, &triangles, strip), whole);
        }
    }
}
