//! What is on top, for every point of a lattice.

use std::ops::Range;

use crate::elements::{self, Elements};
use crate::lattice::{Lattice, Soup, Strips};
use crate::stacks::{CLOSE, Stacks};

/// The element on top, and the face that it shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Top {
    /// Its number.
    pub element: u32,
    /// The upper face is lit.
    pub upper: bool,
}

/// A z-buffer for one strip of a lattice.
#[derive(Default)]
pub struct ZBuffer {
    /// depth, element, side; 0 where nothing is hit
    key: Vec<u64>,
}

/// Points in a strip: its buffer fits a second-level cache.
const LINES_IN_STRIP: usize = 1 << 17;

impl ZBuffer {
    /// Draws all triangles strip by strip. `drawn` is called for each point of each element, `strip`
    /// with the rows of each finished strip.
    ///
    /// `floor_m`: the height of the soil, which hides what lies below it.
    pub fn draw(
        &mut self,
        lattice: &Lattice,
        soup: &Soup,
        elements: &Elements,
        floor_m: Option<f64>,
        mut drawn: impl FnMut(u32),
        mut strip: impl FnMut(&Self, Range<u32>),
    ) {
        let floor = u64::from(floor_m.map_or(0, |z| lattice.depth_of_height(z))) << 32;
        let strips = Strips::new(lattice, soup, LINES_IN_STRIP);
        let stacks = Stacks::new(lattice, soup, elements);
        let nx = lattice.nx as usize;
        for s in 0..strips.len() {
            let rows = strips.rows(s);
            let first_line = rows.start as usize * nx;
            self.key.clear();
            self.key.resize(rows.len() * nx, floor);
            strips.for_each(s, |t, projected| {
                let (first, n) = (elements.first[t as usize], elements.divisions[t as usize]);
                projected.scan(lattice, rows.clone(), n > 1, |f| {
                    let element = if n > 1 {
                        first + elements::piece(n, f.place[0], f.place[1])
                    } else {
                        first
                    };
                    drawn(element);
                    // element + 1: a hit at depth 0 still counts as one
                    let key = u64::from(f.depth) << 32
                        | u64::from(element + 1) << 1
                        | u64::from(projected.upper_along);
                    let top = &mut self.key[f.line - first_line];
                    if is_close(key, *top) {
                        if stacks.is_later(f.line, place(key), place(*top)) {
                            *top = key;
                        }
                    } else {
                        *top = (*top).max(key);
                    }
                });
            });
            strip(self, rows);
        }
    }

    /// What is on top at a point of the strip, by its place in it.
    pub fn top(&self, point: usize) -> Option<Top> {
        let key = self.key[point] as u32;
        let element = (key >> 1).checked_sub(1)?;
        // lines point towards the source: the face that looks along them is lit
        Some(Top {
            element,
            upper: key & 1 == 1,
        })
    }
}

/// Whether two elements are met at close depths.
#[inline]
fn is_close(key: u64, top: u64) -> bool {
    const REACH: u64 = ((CLOSE as u64) + 1) << 32;
    // soil is no element
    key.abs_diff(top) < REACH && top as u32 > 1
}

/// Depth and element.
fn place(key: u64) -> (u32, u32) {
    ((key >> 32) as u32, ((key as u32) >> 1) - 1)
}
