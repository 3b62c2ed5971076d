//! Counts what changes between neighbouring points of a lattice, by organ or over the whole scene.

use glam::DVec3;
use nestrad_kernel::lattice::Lattice;

use super::systematic::Roughness;

/// Along y, from row to row, and along x, from column to column.
#[derive(Clone, Copy)]
pub(super) enum Axis {
    Rows,
    Columns,
}

/// Groups of classes whose points are counted: organs, or the scene as a whole.
#[derive(Clone, Default)]
pub(super) struct Groups {
    /// First class of each group, and the number of classes at the end.
    first: Vec<u32>,
    /// The same of pairs of classes of a group, a class with itself included.
    first_pair: Vec<u32>,
}

/// A class: its group, and its number within the group.
pub(super) type Class = (u32, u32);

impl Groups {
    /// Groups of so many classes each.
    pub(super) fn new(sizes: impl Iterator<Item = u32>) -> Self {
        let (mut first, mut first_pair) = (vec![0], vec![0]);
        let (mut classes, mut pairs) = (0, 0);
        for size in sizes {
            classes += size;
            pairs += size * (size + 1) / 2;
            first.push(classes);
            first_pair.push(pairs);
        }
        Self { first, first_pair }
    }

    fn len(&self) -> usize {
        self.first.len() - 1
    }

    fn size(&self, group: usize) -> u32 {
        self.first[group + 1] - self.first[group]
    }

    fn pair(&self, (group, a): Class, b: u32) -> usize {
        let (low, high) = (a.min(b), a.max(b));
        self.first_pair[group as usize] as usize + (high * (high + 1) / 2 + low) as usize
    }
}

/// What changes across the rows, or the columns, of a lattice.
#[derive(Default)]
struct Changes {
    n: i64,
    closed: bool,
    /// Where each group begins, and how far it reaches: rows or columns.
    start: Vec<i64>,
    length: Vec<i64>,
    /// Where the counts of each group begin.
    first: Vec<usize>,
    /// By how many points each class of a group has more than in the row or column before.
    steps: Vec<i32>,
}

impl Changes {
    /// Of groups that reach from and to these rows or columns.
    fn begin(
        &mut self,
        groups: &Groups,
        n: u32,
        closed: bool,
        reach: impl Iterator<Item = [f64; 2]>,
    ) {
        (self.n, self.closed) = (i64::from(n), closed);
        self.start.clear();
        self.length.clear();
        self.first.clear();
        let mut counts = 0;
        for (group, [from, to]) in reach.enumerate() {
            // what comes and what goes, and a row for the rounding of vertices
            let (from, to) = (from.ceil() as i64 - 1, to.ceil() as i64 + 2);
            let (start, length) = if closed && to - from >= self.n {
                (0, self.n)
            } else if closed {
                (from.rem_euclid(self.n), to - from)
            } else {
                (from.max(0), (to.min(self.n + 1) - from.max(0)).max(0))
            };
            self.start.push(start);
            self.length.push(length);
            self.first.push(counts);
            counts += length as usize * groups.size(group) as usize;
        }
        self.steps.clear();
        self.steps.resize(counts, 0);
    }

    /// Counts a point more or less of a class than before: at a place from 0, before the first row or column, to `n`,
    /// after the last one.
    fn count(&mut self, (group, class): Class, at: usize, change: i32) {
        let group = group as usize;
        let mut k = at as i64 - self.start[group];
        if self.closed && k < 0 {
            k += self.n;
        }
        let length = self.length[group];
        if (0..length).contains(&k) {
            self.steps[self.first[group] + (i64::from(class) * length + k) as usize] += change;
        }
    }

    fn of(&self, group: usize, class: u32) -> &[i32] {
        let length = self.length[group] as usize;
        &self.steps[self.first[group] + class as usize * length..][..length]
    }

    fn roughness(&self, group: usize, [a, b]: [u32; 2]) -> Roughness {
        let closed = self.closed && self.length[group] == self.n;
        Roughness::of(self.of(group, a), self.of(group, b), closed)
    }
}

/// Counts of one direction; its memory is kept from direction to direction.
#[derive(Default)]
pub(super) struct Tally {
    groups: Groups,
    rows: Changes,
    columns: Changes,
    /// Neighbours that show both classes of a pair; a class and itself: that show it and what is not of its group.
    crossings: Vec<u32>,
}

/// What was counted of a pair of classes of a group.
pub(super) struct Counted {
    pub(super) group: usize,
    pub(super) pair: [u32; 2],
    pub(super) crossings: u32,
    /// From row to row and from column to column.
    pub(super) roughness: [Roughness; 2],
}

impl Tally {
    pub(super) fn new(groups: Groups) -> Self {
        Self {
            groups,
            ..Self::default()
        }
    }

    /// Begins anew for groups that lie within these boxes; without boxes, anywhere.
    pub(super) fn begin(&mut self, lattice: &Lattice, boxes: Option<&[[DVec3; 2]]>) {
        let whole = [[0.0, f64::from(lattice.nx)], [0.0, f64::from(lattice.ny)]];
        let reach: Vec<[[f64; 2]; 2]> = (0..self.groups.len())
            .map(|group| match boxes {
                Some(boxes) => {
                    let [lo, hi] = lattice.places_of_box(boxes[group][0], boxes[group][1]);
                    [[lo.x, hi.x], [lo.y, hi.y]]
                }
                None => whole,
            })
            .collect();
        let closed = lattice.periodic;
        let (across, along) = (reach.iter().map(|r| r[0]), reach.iter().map(|r| r[1]));
        self.columns.begin(&self.groups, lattice.nx, closed, across);
        self.rows.begin(&self.groups, lattice.ny, closed, along);
        let pairs = self.groups.first_pair.last().map_or(0, |&n| n as usize);
        self.crossings.clear();
        self.crossings.resize(pairs, 0);
    }

    /// Counts neighbours that show different classes, or none: `at` is the row or column of the second one.
    #[inline]
    pub(super) fn count(&mut self, axis: Axis, [a, b]: [Option<Class>; 2], at: usize) {
        let changes = match axis {
            Axis::Rows => &mut self.rows,
            Axis::Columns => &mut self.columns,
        };
        if let Some(class) = a {
            changes.count(class, at, -1);
        }
        if let Some(class) = b {
            changes.count(class, at, 1);
        }
        match (a, b) {
            (Some(a), Some(b)) if a.0 == b.0 => {
                self.crossings[self.groups.pair(a, b.1)] += 1;
            }
            _ => {
                for class in [a, b].into_iter().flatten() {
                    self.crossings[self.groups.pair(class, class.1)] += 1;
                }
            }
        }
    }

    /// All pairs of each group that shows anything, groups in order.
    pub(super) fn counted(&self) -> impl Iterator<Item = Counted> + '_ {
        let shows = |group: &usize| {
            let pairs = self.groups.first_pair[*group]..self.groups.first_pair[group + 1];
            pairs
                .into_iter()
                .any(|pair| self.crossings[pair as usize] > 0)
        };
        (0..self.groups.len()).filter(shows).flat_map(move |group| {
            let size = self.groups.size(group);
            let pairs = (0..size).flat_map(|b| (0..=b).map(move |a| [a, b]));
            pairs.map(move |pair| Counted {
                group,
                pair,
                crossings: self.crossings[self.groups.pair((group as u32, pair[0]), pair[1])],
                roughness: [&self.rows, &self.columns].map(|c| c.roughness(group, pair)),
            })
        })
    }
}
