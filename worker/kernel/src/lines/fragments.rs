//! The hits of every line of a lattice, sorted along it.
//!
//! A lattice of many lines is worked off in strips of whole rows, which bounds the memory that its
//! fragments take. Within a strip fragments are sorted by line with a counting sort, then by depth.

use std::ops::Range;

use glam::DVec3;

use crate::block::Block;
use crate::elements;
use crate::lattice::{Lattice, Projected, Strips, rows_of_part};
use crate::part::Part;
use crate::stacks::{CLOSE, Stacks};

/// Where a line meets the block: depth along the line, local element, and which face it meets.
///
/// Packed so that hits sort by depth, then by element: the order does not depend on the order of
/// drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub(crate) struct Hit(u64);

impl Hit {
    fn new(depth: u32, local_element: u32, upper_along: bool) -> Self {
        Self(u64::from(depth) << 32 | u64::from(local_element) << 1 | u64::from(upper_along))
    }

    /// In steps of the lattice's depth.
    pub(crate) fn depth(self) -> u32 {
        (self.0 >> 32) as u32
    }

    fn local_element(self) -> u32 {
        self.face_against() >> 1
    }

    /// The same face, at another depth.
    fn at_depth(self, depth: u32) -> Self {
        Self(u64::from(depth) << 32 | u64::from(self.face_against()))
    }

    /// The local face that looks along the direction of the lines.
    pub(crate) fn face_along(self) -> u32 {
        self.face_against() ^ 1
    }

    /// The local face that looks against the direction of the lines.
    pub(crate) fn face_against(self) -> u32 {
        // bit 0 is set when the upper face looks along: then the lower face (odd) looks against
        self.0 as u32
    }
}

/// Lines in a strip: with some ten hits each, its fragments take ten megabytes. Smaller strips would stay in a
/// cache, but for those the triangles have to be sorted into strips first, which costs more.
const LINES_IN_STRIP: usize = 1 << 16;

/// Calls `line` with the number of the lattice and the hits of every line of a part of each lattice, by
/// rising depth; the lines of a lattice by rising number. Returns the number of lines of each.
///
/// Lattices that are one strip each are drawn together, so that the triangles, of which there are more than
/// a cache holds, are read once for all of them.
pub(crate) fn for_each_line(
    block: &Block,
    lattices: &[Lattice],
    parts: &[Part],
    mut line: impl FnMut(usize, usize, &[Hit]),
) -> Vec<u64> {
    let is_one_strip = |lattice: &Lattice| lattice.lines() <= LINES_IN_STRIP;
    if lattices.iter().all(is_one_strip) && parts.iter().all(|part| part.of(1).len() == 1) {
        return draw_together(block, lattices, line);
    }
    let each = lattices.iter().zip(parts).enumerate();
    each.map(|(k, (lattice, &part))| {
        for_each_line_of_part(block, lattice, part, |number, hits| line(k, number, hits))
    })
    .collect()
}

/// The rows of a lattice whose lines are those of a part of it.
pub(crate) fn rows_of(lattice: &Lattice, part: Part) -> Range<u32> {
    rows_of_part(lattice, LINES_IN_STRIP, part)
}

fn draw_together(
    block: &Block,
    lattices: &[Lattice],
    mut line: impl FnMut(usize, usize, &[Hit]),
) -> Vec<u64> {
    let mut strips: Vec<Strip> = lattices
        .iter()
        .map(|lattice| {
            let mut strip = Strip::default();
            strip.begin(0..lattice.ny, lattice.nx);
            strip
        })
        .collect();
    block.soup.for_each_reached_of(lattices, |k, t, triangle| {
        if let Some(projected) = Projected::new(&lattices[k], triangle) {
            strips[k].draw(block, &lattices[k], t, &projected);
        }
    });
    for (k, strip) in strips.iter_mut().enumerate() {
        strip.sort();
        let stacks = Stacks::new(&lattices[k], &block.soup, &block.elements);
        strip.for_each_line(&stacks, &mut |number, hits| line(k, number, hits));
    }
    lattices.iter().map(|l| l.lines() as u64).collect()
}

/// Calls `line` with the hits of every line of one row of a lattice.
pub(crate) fn for_each_line_of_row(
    block: &Block,
    lattice: &Lattice,
    row: u32,
    mut line: impl FnMut(usize, &[Hit]),
) {
    let mut strip = Strip::default();
    strip.begin(row..row + 1, lattice.nx);
    let draw = |_, t, triangle: &[DVec3; 3]| {
        if lattice.may_meet(&(row..row + 1), triangle)
            && let Some(projected) = Projected::new(lattice, triangle)
        {
            strip.draw(block, lattice, t, &projected);
        }
    };
    block
        .soup
        .for_each_reached_of(std::slice::from_ref(lattice), draw);
    strip.sort();
    let stacks = Stacks::new(lattice, &block.soup, &block.elements);
    strip.for_each_line(&stacks, &mut line);
}

fn for_each_line_of_part(
    block: &Block,
    lattice: &Lattice,
    part: Part,
    mut line: impl FnMut(usize, &[Hit]),
) -> u64 {
    let strips = Strips::new(lattice, &block.soup, LINES_IN_STRIP);
    let stacks = Stacks::new(lattice, &block.soup, &block.elements);
    let mut strip = Strip::default();
    let mut lines = 0;
    for s in part.of(strips.len() as usize) {
        let rows = strips.rows(s as u32);
        lines += u64::from(rows.end - rows.start) * u64::from(lattice.nx);
        strip.begin(rows, lattice.nx);
        strips.for_each(s as u32, |t, projected| {
            strip.draw(block, lattice, t, projected)
        });
        strip.sort();
        strip.for_each_line(&stacks, &mut line);
    }
    lines
}

/// Fragments of one strip of a lattice; buffers are kept from strip to strip.
#[derive(Default)]
struct Strip {
    /// Rows of the lattice.
    rows: Range<u32>,
    first_line: usize,
    /// (line within the strip, hit), as drawn.
    drawn: Vec<(u32, Hit)>,
    /// End of each line's hits in `hits`, after sorting.
    end: Vec<u32>,
    hits: Vec<Hit>,
}

impl Strip {
    /// An empty strip of these rows, of `nx` lines each.
    fn begin(&mut self, rows: Range<u32>, nx: u32) {
        let nx = nx as usize;
        self.first_line = rows.start as usize * nx;
        self.drawn.clear();
        self.end.clear();
        self.end.resize((rows.end - rows.start) as usize * nx, 0);
        self.rows = rows;
    }

    /// Adds the hits of triangle `t`.
    fn draw(&mut self, block: &Block, lattice: &Lattice, t: u32, projected: &Projected) {
        let cut = &block.elements;
        let (first, n) = (cut.first[t as usize], cut.divisions[t as usize]);
        projected.scan(lattice, self.rows.clone(), n > 1, |f| {
            let element = if n > 1 {
                first + elements::piece(n, f.place[0], f.place[1])
            } else {
                first
            };
            let line = f.line - self.first_line;
            self.end[line] += 1;
            self.drawn.push((
                line as u32,
                Hit::new(f.depth, element, projected.upper_along),
            ));
        });
    }

    fn sort(&mut self) {
        let mut total = 0;
        for end in &mut self.end {
            let count = *end;
            *end = total;
            total += count;
        }
        self.hits.resize(total as usize, Hit::default());
        for &(line, hit) in &self.drawn {
            let place = &mut self.end[line as usize];
            self.hits[*place as usize] = hit;
            *place += 1;
        }
    }

    fn for_each_line(&mut self, stacks: &Stacks, line: &mut impl FnMut(usize, &[Hit])) {
        let mut start = 0;
        for (k, &end) in self.end.iter().enumerate() {
            let hits = &mut self.hits[start..end as usize];
            hits.sort_unstable();
            settle(stacks, self.first_line + k, hits);
            line(self.first_line + k, hits);
            start = end as usize;
        }
    }
}

/// Puts faces that are met at close depths in the order in which they lie; `hits` by depth, which they stay.
fn settle(stacks: &Stacks, line: usize, hits: &mut [Hit]) {
    let close = |a: &Hit, b: &Hit| b.depth() - a.depth() <= CLOSE;
    if hits.is_sorted_by(|a, b| !close(a, b)) {
        return;
    }
    for stack in hits.chunk_by_mut(close).filter(|stack| stack.len() > 1) {
        let drawn = stack.to_vec();
        let places = drawn.iter().map(|hit| (hit.depth(), hit.local_element()));
        for (k, from) in stacks.order(line, places).into_iter().enumerate() {
            stack[k] = drawn[from].at_depth(drawn[k].depth());
        }
    }
}
