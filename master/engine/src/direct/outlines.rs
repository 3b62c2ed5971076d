//! How well a lattice counts the area of an organ: from what changes between neighbouring points.
//!
//! The variance of a count of lattice points is a sum over waves that fit the lattice. Those along the rows and along the
//! columns are most of it, and nearly all where an edge runs along them: they follow from how the count of the organ
//! changes from row to row and from column to column (`systematic.rs`). All others go with the length of the outline.

use glam::DVec3;
use nestrad_kernel::lattice::Lattice;
use nestrad_kernel::zbuffer::Top;

use super::classes::{Classes, Face};
use super::systematic::Roughness;
use super::tally::{Axis, Counted, Tally};
use crate::frame::Frame;

/// Of the variance of an area that is measured by counting points of a square lattice of spacing h, `0.0724 h³ P` (P
/// the length of its outline, on average over its directions; Gundersen & Jensen 1987, after Matérn), waves along rows
/// and columns are 0.54: of a disc of radius r they leave 2 · ζ(3)/π² r. A lattice counts `4/pi P/h` neighbours across an
/// outline of any direction.
const VARIANCE_PER_CROSSING: f64 = 0.46 * 0.0724 * std::f64::consts::FRAC_PI_4;

/// What is uncertain of the points that show an organ, or the scene: for a pair of its classes, or a class with itself.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline {
    /// Its organ, if it is not of the scene.
    pub(super) organ: u32,
    faces: [Face; 2],
    /// Neighbours that show the one and the other; with itself: that show the class and what is not the organ.
    crossings: u32,
    /// From row to row and from column to column.
    roughness: [Roughness; 2],
}

/// Variance of a sum over points, each of them worth what its face is, in parts of that of a point.
pub(super) fn variance(outlines: &[Outline], worth: impl Fn(Face) -> f64) -> f64 {
    let mut terms: Vec<[f64; 5]> = outlines
        .iter()
        .map(|outline| {
            let [a, b] = outline.faces.map(&worth);
            let itself = outline.faces[0] == outline.faces[1];
            let differ = if itself { a } else { a - b };
            let times = if itself { a * a } else { 2.0 * a * b };
            let [Roughness([r1, r2]), Roughness([c1, c2])] = outline.roughness;
            let crossings = f64::from(outline.crossings) * differ * differ;
            [crossings, times * r1, times * r2, times * c1, times * c2]
        })
        .collect();
    // materials have no order that is the same for all who name them: so what is added is sorted
    let mut sum_of = |k: usize| {
        terms.sort_unstable_by(|a, b| a[k].total_cmp(&b[k]));
        terms.iter().map(|term| term[k]).sum::<f64>()
    };
    let crossings = sum_of(0);
    let rows = Roughness([sum_of(1), sum_of(2)]);
    let columns = Roughness([sum_of(3), sum_of(4)]);
    VARIANCE_PER_CROSSING * crossings + rows.variance() + columns.variance()
}

/// Counts of the outlines of a direction; memory is kept from direction to direction.
pub(super) struct Outlines {
    organs: Tally,
    scene: Tally,
    /// What the last row showed, and the first one.
    last: Vec<Option<Top>>,
    first: Vec<Option<Top>>,
}

/// Looks at the points of a lattice, row by row.
pub(super) struct Looking<'a> {
    pub(super) frame: &'a Frame,
    pub(super) classes: &'a Classes,
    /// Organs whose light is not counted by points.
    pub(super) thin: &'a [bool],
    pub(super) lattice: &'a Lattice,
}

impl Outlines {
    pub(super) fn new(classes: &Classes) -> Self {
        Self {
            organs: Tally::new(classes.organs()),
            scene: Tally::new(classes.scene()),
            last: Vec::new(),
            first: Vec::new(),
        }
    }

    /// Begins anew, with the boxes of all organs.
    pub(super) fn begin(&mut self, lattice: &Lattice, boxes: &[[DVec3; 2]]) {
        self.organs.begin(lattice, Some(boxes));
        self.scene.begin(lattice, None);
        self.last.clear();
        self.first.clear();
    }

    /// Counts a row; rows come in order.
    pub(super) fn row(&mut self, looking: &Looking, j: usize, top: impl Fn(usize) -> Option<Top>) {
        let nx = looking.lattice.nx as usize;
        let closed = looking.lattice.periodic;
        // beyond an open lattice is nothing
        let mut before = if closed { top(nx - 1) } else { None };
        let is_first = self.last.is_empty();
        if is_first {
            self.last.resize(nx, None);
        }
        for i in 0..nx {
            let here = top(i);
            self.differ(looking, Axis::Columns, [before, here], i);
            if !(is_first && closed) {
                self.differ(looking, Axis::Rows, [self.last[i], here], j);
            }
            before = here;
            self.last[i] = here;
        }
        if !closed {
            self.differ(looking, Axis::Columns, [before, None], nx);
        }
        if is_first {
            self.first.clone_from(&self.last);
        }
    }

    /// Counts what is above the last row: the first one of a torus.
    fn close(&mut self, looking: &Looking) {
        let closed = looking.lattice.periodic;
        let at = if closed {
            0
        } else {
            looking.lattice.ny as usize
        };
        for i in 0..self.last.len() {
            let above = if closed { self.first[i] } else { None };
            self.differ(looking, Axis::Rows, [self.last[i], above], at);
        }
    }

    #[inline]
    fn differ(
        &mut self,
        &Looking {
            frame,
            classes,
            thin,
            ..
        }: &Looking,
        axis: Axis,
        tops: [Option<Top>; 2],
        at: usize,
    ) {
        if tops[0] == tops[1] {
            return;
        }
        let counted = |top: Top| {
            let class = classes.of_organ(frame, top);
            (!thin[class.0 as usize]).then_some(class)
        };
        let [a, b] = tops.map(|top| top.and_then(counted));
        if a != b {
            self.organs.count(axis, [a, b], at);
        }
        let [a, b] = tops.map(|top| classes.of_scene(frame, top));
        if a != b {
            self.scene.count(axis, [a, b], at);
        }
    }

    /// All outlines: of organs, in order, and of the scene.
    pub(super) fn finish(&mut self, looking: &Looking) -> [Vec<Outline>; 2] {
        self.close(looking);
        let classes = looking.classes;
        let outline = |counted: Counted, faces: [Face; 2]| Outline {
            organ: counted.group as u32,
            faces,
            crossings: counted.crossings,
            roughness: counted.roughness,
        };
        let organs = self.organs.counted().map(|counted| {
            let faces = counted
                .pair
                .map(|class| classes.face_of_organ(counted.group, class));
            outline(counted, faces)
        });
        let scene = self.scene.counted().map(|counted| {
            let faces = counted.pair.map(|class| classes.face_of_scene(class));
            outline(counted, faces)
        });
        [organs.collect(), scene.collect()]
    }
}
