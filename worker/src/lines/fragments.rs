//! The hits of every line of a lattice, sorted along it.
//!
//! The lattice is worked off in strips of whole rows, small enough that a strip's fragments stay in
//! the cache. Within a strip fragments are sorted by line with a counting sort, then by depth.

use nestrad_common::elements;
use nestrad_common::lattice::{Lattice, Projected};

use crate::block::Block;

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

/// Lines in a strip: with some ten hits each, a strip's fragments fit a second-level cache.
const LINES_IN_STRIP: usize = 1 << 14;

/// Calls `line` with the hits of every line of the lattice, by rising depth; lines by rising number.
pub(crate) fn for_each_line(block: &Block, lattice: &Lattice, mut line: impl FnMut(usize, &[Hit])) {
    let rows_in_strip = (LINES_IN_STRIP / lattice.nx as usize).max(1) as u32;
    let strips = lattice.ny.div_ceil(rows_in_strip);
    let members = (strips > 1).then(|| members_of_strips(block, lattice, rows_in_strip, strips));
    let mut strip = Strip::default();
    for s in 0..strips {
        let rows = s * rows_in_strip..((s + 1) * rows_in_strip).min(lattice.ny);
        match &members {
            Some(m) => strip.draw(block, lattice, rows, m.of(s).iter().copied()),
            None => strip.draw(block, lattice, rows, 0..block.triangles.len() as u32),
        }
        strip.sort();
        strip.for_each_line(&mut line);
    }
}

/// The triangles of each strip.
struct Members {
    start: Vec<usize>,
    triangles: Vec<u32>,
}

impl Members {
    fn of(&self, strip: u32) -> &[u32] {
        &self.triangles[self.start[strip as usize]..self.start[strip as usize + 1]]
    }
}

fn members_of_strips(block: &Block, lattice: &Lattice, rows_in_strip: u32, strips: u32) -> Members {
    let ny = i64::from(lattice.ny);
    let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(block.triangles.len() * 2);
    for (t, triangle) in block.triangles.iter().enumerate() {
        let Some(projected) = Projected::new(lattice, triangle) else {
            continue;
        };
        let rows = projected.rows();
        if lattice.periodic && rows.end - rows.start >= ny {
            pairs.extend((0..strips).map(|s| (s, t as u32)));
            continue;
        }
        let strip_of = |row: i64| (row / i64::from(rows_in_strip)) as u32;
        let mut add = |from: i64, to: i64| {
            if from < to {
                pairs.extend((strip_of(from)..=strip_of(to - 1)).map(|s| (s, t as u32)));
            }
        };
        if lattice.periodic {
            let from = rows.start.rem_euclid(ny);
            let to = from + rows.end - rows.start;
            // the part past the seam may reach back into the strip where it began: once is enough
            add(from, to.min(ny));
            let past = (to - ny)
                .max(0)
                .min(i64::from(rows_in_strip) * i64::from(strip_of(from)));
            add(0, past);
        } else {
            add(rows.start.max(0), rows.end.min(ny));
        }
    }
    let mut start = vec![0usize; strips as usize + 1];
    for &(s, _) in &pairs {
        start[s as usize + 1] += 1;
    }
    for s in 0..strips as usize {
        start[s + 1] += start[s];
    }
    let mut next = start.clone();
    let mut triangles = vec![0; pairs.len()];
    for (s, t) in pairs {
        triangles[next[s as usize]] = t;
        next[s as usize] += 1;
    }
    Members { start, triangles }
}

/// Fragments of one strip of the lattice; buffers are kept from strip to strip.
#[derive(Default)]
struct Strip {
    first_line: usize,
    /// (line within the strip, hit), as drawn.
    drawn: Vec<(u32, Hit)>,
    /// End of each line's hits in `hits`, after sorting.
    end: Vec<u32>,
    hits: Vec<Hit>,
}

impl Strip {
    fn draw(
        &mut self,
        block: &Block,
        lattice: &Lattice,
        rows: std::ops::Range<u32>,
        triangles: impl Iterator<Item = u32>,
    ) {
        let nx = lattice.nx as usize;
        self.first_line = rows.start as usize * nx;
        self.drawn.clear();
        self.end.clear();
        self.end.resize((rows.end - rows.start) as usize * nx, 0);
        for t in triangles {
            let t = t as usize;
            let Some(projected) = Projected::new(lattice, &block.triangles[t]) else {
                continue;
            };
            let (first, n) = (block.first[t], block.divisions[t]);
            projected.scan(lattice, rows.clone(), n > 1, |f| {
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

    fn for_each_line(&mut self, line: &mut impl FnMut(usize, &[Hit])) {
        let mut start = 0;
        for (k, &end) in self.end.iter().enumerate() {
            let hits = &mut self.hits[start..end as usize];
            hits.sort_unstable();
            line(self.first_line + k, hits);
            start = end as usize;
        }
    }
}
