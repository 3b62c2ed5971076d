//! What of an element stands above the plane of the soil.
//!
//! An element that the soil cuts is lit and seen on the part above only. That part is known exactly, however thin
//! it is: to the lines of the exchange, a leaf that peeps out by less than their distance would look buried.

use glam::DVec3;

use crate::elements::piece_corners;

/// A corner, in barycentric coordinates of the second and third vertex of the triangle.
type Corner = (f64, f64);

/// The part of an element above a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Above {
    /// All of it.
    Whole,
    /// None of it, or too little to tell.
    Nothing,
    /// A part.
    Part(Part),
}

/// The part above of an element that is cut: one or two triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Its share of the element's area.
    pub share: f64,
    first: [Corner; 3],
    second: [Corner; 3],
    /// Share of the first triangle in the part.
    first_share: f64,
}

/// Less than this of an element is nothing.
const LEAST_SHARE: f64 = 1e-9;

impl Above {
    /// What of a triangle's piece (which of how many: `elements::piece`) stands above the height `z_m`.
    pub fn of([a, b, c]: &[DVec3; 3], (piece, divisions): (u32, u32), z_m: f64) -> Self {
        if a.z.min(b.z).min(c.z) >= z_m {
            return Self::Whole;
        }
        let corners = piece_corners(divisions, piece);
        let height = |&(b1, b2): &Corner| (a.z - z_m) + b1 * (b.z - a.z) + b2 * (c.z - a.z);
        let heights = corners.each_ref().map(height);
        let above = heights.map(|h| h > 0.0);
        if heights.iter().all(|&h| h >= 0.0) {
            return Self::Whole;
        }
        // the corner that stands alone on its side, and where the plane cuts the edges from it
        let Some(alone) =
            (0..3).find(|&k| above[k] != above[(k + 1) % 3] && above[k] != above[(k + 2) % 3])
        else {
            return Self::Nothing;
        };
        let [next, last] = [(alone + 1) % 3, (alone + 2) % 3];
        let along = |to: usize| heights[alone] / (heights[alone] - heights[to]);
        let (s, t) = (along(next), along(last));
        let cut = |to: usize, s: f64| {
            let ((x0, y0), (x1, y1)) = (corners[alone], corners[to]);
            (x0 + s * (x1 - x0), y0 + s * (y1 - y0))
        };
        let (p, q) = (cut(next, s), cut(last, t));
        let part = if above[alone] {
            let tip = [corners[alone], p, q];
            Part {
                share: s * t,
                first: tip,
                second: tip,
                first_share: 1.0,
            }
        } else {
            // the quadrilateral p, next, last, q, cut from p to last
            let (first, second) = ((1.0 - s), s * (1.0 - t));
            Part {
                share: first + second,
                first: [p, corners[next], corners[last]],
                second: [p, corners[last], q],
                first_share: first / (first + second),
            }
        };
        if part.share < LEAST_SHARE {
            Self::Nothing
        } else {
            Self::Part(part)
        }
    }
}

impl Part {
    /// Corners of a triangle of the part, and what is left of a random number in [0, 1) that chose it: uniform
    /// numbers make for points that are uniform over the part.
    pub fn triangle(&self, random: f64) -> ([Corner; 3], f64) {
        if random < self.first_share {
            (self.first, random / self.first_share)
        } else {
            let rest = (random - self.first_share) / (1.0 - self.first_share);
            (self.second, rest.min(1.0 - f64::EPSILON))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nestrad_common::geometry::{area, point_within};
    use proptest::prelude::*;

    const WHOLE: (u32, u32) = (0, 1);

    fn share(above: Above) -> f64 {
        match above {
            Above::Whole => 1.0,
            Above::Nothing => 0.0,
            Above::Part(part) => part.share,
        }
    }

    fn triangle(heights: [f64; 3]) -> [DVec3; 3] {
        [DVec3::ZERO, DVec3::X, DVec3::Y]
            .into_iter()
            .zip(heights)
            .map(|(p, h)| p + DVec3::Z * h)
            .collect::<Vec<_>>()
            .try_into()
            .unwrap()
    }

    #[test]
    fn what_touches_the_plane_from_above_is_whole_and_from_below_is_nothing() {
        for heights in [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0]] {
            assert_eq!(Above::of(&triangle(heights), WHOLE, 0.0), Above::Whole);
            let below = heights.map(|h| -h);
            let expected = if heights == [0.0; 3] {
                Above::Whole
            } else {
                Above::Nothing
            };
            assert_eq!(Above::of(&triangle(below), WHOLE, 0.0), expected);
        }
    }

    #[test]
    fn a_leaf_that_peeps_out_has_the_square_of_its_height_as_share() {
        let above = Above::of(&triangle([-1.0, -1.0, 1e-3]), WHOLE, 0.0);
        let expected = (1e-3f64 / 1.001).powi(2);
        assert!((share(above) / expected - 1.0).abs() < 1e-9, "{above:?}");
    }

    proptest! {
        #[test]
        fn points_of_the_part_stand_above_and_fill_its_share(heights in prop::array::uniform3(-1.0..1.0f64), turn in 0..3usize) {
            let mut triangle = triangle(heights);
            triangle.rotate_left(turn);
            let Above::Part(part) = Above::of(&triangle, WHOLE, 0.0) else { return Ok(()); };
            let mut areas = 0.0;
            for (corners, wanted) in [(part.first, part.first_share), (part.second, 1.0 - part.first_share)] {
                if wanted > 0.0 {
                    let at = |&(b1, b2): &Corner| triangle[0] + b1 * (triangle[1] - triangle[0]) + b2 * (triangle[2] - triangle[0]);
                    let piece = area(&corners.each_ref().map(at)) / area(&triangle);
                    prop_assert!((piece - wanted * part.share).abs() < 1e-12);
                    areas += piece;
                }
            }
            prop_assert!((areas - part.share).abs() < 1e-12);
            for k in 0..64 {
                let random = (f64::from(k) + 0.5) / 64.0;
                let (corners, rest) = part.triangle(random);
                prop_assert!((0.0..1.0).contains(&rest));
                prop_assert!(point_within(&triangle, &corners, [rest, 1.0 - random]).z > -1e-12);
            }
        }

        #[test]
        fn parts_above_and_below_make_up_the_whole(heights in prop::array::uniform3(-1.0..1.0f64)) {
            let (up, down) = (triangle(heights), triangle(heights.map(|h| -h)));
            let [above, below] = [up, down].map(|t| share(Above::of(&t, WHOLE, 0.0)));
            prop_assert!((above + below - 1.0).abs() < 2e-9, "{above} {below}");
        }
    }
}
