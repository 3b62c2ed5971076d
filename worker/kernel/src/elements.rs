//! Elements: what carries one radiosity per face. A triangle is one element, or `n * n` congruent
//! pieces when it is too large.
//!
//! Pieces are never drawn themselves. A line meets the *triangle*, and where it meets it says which
//! piece: so pieces of one triangle can neither overlap nor leave a gap.

use std::ops::Range;

use glam::DVec3;
use nestrad_common::geometry;

/// Most pieces along one edge: a needle must not turn into a million elements.
pub const MAX_DIVISIONS: u32 = 128;

/// How triangles are cut into elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Elements {
    /// Number of the first element of each triangle, and one past the last one at the end.
    pub first: Vec<u32>,
    /// Pieces along an edge, per triangle; at least 1.
    pub divisions: Vec<u32>,
}

impl Elements {
    /// Cuts every triangle whose longest edge exceeds `max_edge_m` (metres, > 0).
    pub fn divide(triangles: impl Iterator<Item = [DVec3; 3]>, max_edge_m: f64) -> Self {
        let mut elements = Self::with_room(triangles.size_hint().0);
        for triangle in triangles {
            elements.push(divisions(&triangle, max_edge_m));
        }
        elements
    }

    /// No elements yet, with room for those of so many triangles.
    pub(crate) fn with_room(triangles: usize) -> Self {
        let mut first = Vec::with_capacity(triangles + 1);
        first.push(0);
        Self {
            first,
            divisions: Vec::with_capacity(triangles),
        }
    }

    /// Adds a triangle that is cut into `divisions²` elements.
    pub(crate) fn push(&mut self, divisions: u32) {
        let end = self.len() as u32 + divisions * divisions;
        self.first.push(end);
        self.divisions.push(divisions);
    }

    /// How many there would be.
    pub fn count(triangles: impl Iterator<Item = [DVec3; 3]>, max_edge_m: f64) -> u64 {
        let pieces = |t: [DVec3; 3]| u64::from(divisions(&t, max_edge_m)).pow(2);
        triangles.map(pieces).sum()
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.first.last().map_or(0, |&end| end as usize)
    }

    /// No elements at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.divisions.len()
    }

    /// The elements of a triangle.
    #[inline]
    pub fn of(&self, triangle: usize) -> Range<u32> {
        self.first[triangle]..self.first[triangle + 1]
    }

    /// The triangle that an element belongs to.
    pub(crate) fn triangle(&self, element: u32) -> usize {
        if self.len() == self.divisions.len() {
            // none is cut
            return element as usize;
        }
        self.first.partition_point(|&first| first <= element) - 1
    }

    /// The triangle that each element belongs to.
    pub fn triangle_of_element(&self) -> Vec<u32> {
        let mut owner = vec![0; self.len()];
        for (t, ends) in self.first.windows(2).enumerate() {
            owner[ends[0] as usize..ends[1] as usize].fill(t as u32);
        }
        owner
    }
}

/// Pieces along an edge of a triangle whose pieces are to have edges of `max_edge_m` (metres, > 0) at most.
pub fn divisions(triangle: &[DVec3; 3], max_edge_m: f64) -> u32 {
    let longest = geometry::longest_edge(triangle);
    // pieces are as slender as the triangle, so a slender one would have far more than its area needs
    let by_area = (MOST_PIECES * geometry::area(triangle)).sqrt() / max_edge_m;
    let n = (longest / max_edge_m).min(by_area).ceil();
    if n.is_finite() {
        (n as u32).clamp(1, MAX_DIVISIONS)
    } else {
        1
    }
}

/// Most pieces of a triangle in an area of the square of the longest edge: those of a triangle of which
/// one edge is 16 times as long as the height over it.
const MOST_PIECES: f64 = 32.0;

/// The piece, `0..n*n`, that holds the point with barycentric coordinates `b1`, `b2` of the second
/// and third vertex, when each edge is cut into `n`.
///
/// Rows run parallel to the edge v0-v2; row `r` holds `2 (n - r) - 1` pieces, upright and inverted
/// ones in turn.
pub fn piece(n: u32, b1: f64, b2: f64) -> u32 {
    let nf = f64::from(n);
    let row = ((b1 * nf).max(0.0) as u32).min(n - 1);
    let column = ((b2 * nf).max(0.0) as u32).min(n - 1 - row);
    // In the lattice cell (row, column) the diagonal separates the upright from the inverted piece.
    let beyond_diagonal = (b1 * nf - f64::from(row)) + (b2 * nf - f64::from(column)) > 1.0;
    let inverted = beyond_diagonal && column < n - 1 - row;
    row * (2 * n - row) + 2 * column + u32::from(inverted)
}

/// The corners of piece `index` in barycentric coordinates `(b1, b2)`: the inverse of [`piece`].
pub fn piece_corners(n: u32, index: u32) -> [(f64, f64); 3] {
    let mut row = 0;
    while row + 1 < n && index >= (row + 1) * (2 * n - row - 1) {
        row += 1;
    }
    let within = index - row * (2 * n - row);
    let (column, inverted) = (within / 2, within % 2 == 1);
    let at = |r: u32, c: u32| (f64::from(r) / f64::from(n), f64::from(c) / f64::from(n));
    if inverted {
        [
            at(row + 1, column),
            at(row + 1, column + 1),
            at(row, column + 1),
        ]
    } else {
        [at(row, column), at(row + 1, column), at(row, column + 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_holds_its_own_centre() {
        for n in 1..=9 {
            for index in 0..n * n {
                let corners = piece_corners(n, index);
                let b1 = corners.iter().map(|c| c.0).sum::<f64>() / 3.0;
                let b2 = corners.iter().map(|c| c.1).sum::<f64>() / 3.0;
                assert_eq!(piece(n, b1, b2), index, "n = {n}");
            }
        }
    }

    #[test]
    fn points_on_or_past_the_rim_stay_inside() {
        for n in [1, 2, 5, MAX_DIVISIONS] {
            for (b1, b2) in [
                (0.0, 0.0),
                (1.0, 0.0),
                (0.0, 1.0),
                (-1e-9, 1.0 + 1e-9),
                (1.0 + 1e-9, -1e-9),
            ] {
                assert!(piece(n, b1, b2) < n * n);
            }
        }
    }

    #[test]
    fn a_needle_is_not_cut_into_thousands() {
        let needle = |width: f64| std::iter::once([DVec3::ZERO, DVec3::X, DVec3::Y * width]);
        // as ever up to a slenderness of 16
        assert_eq!(Elements::divide(needle(1.0 / 15.0), 0.01).len(), 101 * 101);
        for (width, most) in [(1e-3, 200), (1e-6, 1), (0.0, 1)] {
            let elements = Elements::divide(needle(width), 0.01);
            assert!(elements.len() <= most, "{width}: {}", elements.len());
            assert_eq!(Elements::count(needle(width), 0.01), elements.len() as u64);
        }
    }

    #[test]
    fn large_triangles_are_cut() {
        let triangles = [
            [DVec3::ZERO, DVec3::X, DVec3::Y],
            [DVec3::ZERO, DVec3::X * 0.1, DVec3::Y * 0.1],
        ];
        let elements = Elements::divide(triangles.into_iter(), 0.2);
        assert_eq!(elements.divisions, [8, 1]);
        assert_eq!(elements.first, [0, 64, 65]);
        assert_eq!(elements.triangle_of_element()[64], 1);
    }
}
