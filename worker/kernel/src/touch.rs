//! Surfaces that touch: which of them a line or a ray comes to first.
//!
//! Faces that lie in one plane, or a rounding apart, are a stack. Its order belongs to the plane and not to the line:
//! whichever side a line comes from, the faces on the two ends of the stack are the same, and between them all is
//! dark. So a plane has a canonical normal, and faces lie by rising number along it.

use glam::DVec3;
use nestrad_common::geometry;

use crate::elements::Elements;
use crate::lattice::{Extent, Lattice, Soup};

/// Surfaces that are closer together than this part of the largest coordinate touch. Rounding in f64 moves the place
/// where a line of 0.1 degrees above the horizon meets a plane by a tenth of that.
const TOUCH: f64 = 1.0 / (1u64 << 40) as f64;

/// The canonical normal of a plane is on this side of it. Hardly any plane holds this direction, so a rounding does not
/// turn the normal over.
const CANONICAL: DVec3 = DVec3::new(0.537_767_139, 0.313_033_187, 0.782_811_373);

/// What lies closer together than this touches, metres. It is the same for all parts of a scene.
pub(crate) fn touch_m(extent: &Extent) -> f64 {
    TOUCH * extent.min_m.abs().max(extent.max_m.abs()).max_element()
}

/// Whether something that moves along a direction comes to the lower of two touching faces first; `lower` is the
/// triangle of the one with the lower number.
pub(crate) fn lower_first(lower: &[DVec3; 3], direction: DVec3) -> bool {
    let normal = geometry::doubled_area_vector(lower);
    (normal.dot(CANONICAL) > 0.0) == (normal.dot(direction) > 0.0)
}

/// Depths of one place differ by rounding to whole steps, once for each of two faces.
pub(crate) const CLOSE: u32 = 2;

/// Copies of a triangle that are looked at: of one that is larger than so many patterns, the depth has to do.
const MOST_COPIES: usize = 64;

/// The faces that the lines of a lattice meet in almost the same place.
pub(crate) struct Stacks<'a> {
    lattice: &'a Lattice,
    soup: &'a Soup,
    elements: &'a Elements,
}

/// Where a line meets an element.
#[derive(Clone, Copy, Debug)]
struct Met {
    /// Distance along the line, metres.
    s_m: f64,
    /// Of the angle between line and normal, >= 0.
    cosine: f64,
    element: u32,
}

impl Met {
    fn touches(&self, other: &Self, touch_m: f64) -> bool {
        (self.s_m - other.s_m).abs() * self.cosine.max(other.cosine) <= touch_m
    }
}

impl<'a> Stacks<'a> {
    pub(crate) fn new(lattice: &'a Lattice, soup: &'a Soup, elements: &'a Elements) -> Self {
        Self {
            lattice,
            soup,
            elements,
        }
    }

    /// Of two elements that a line meets at close depths, whether the first one comes later along it.
    pub(crate) fn is_later(&self, line: usize, one: (u32, u32), other: (u32, u32)) -> bool {
        let [a, b] = [one, other].map(|(depth, element)| self.meet(line, depth, element));
        if !a.touches(&b, self.lattice.touch_m) {
            return a.s_m > b.s_m;
        }
        let lower = self.triangle(a.element.min(b.element));
        lower_first(&lower, self.lattice.direction) == (a.element > b.element)
    }

    /// The order of elements that a line meets at close depths (depth, element): which comes first, second, and so on.
    pub(crate) fn order(&self, line: usize, hits: impl Iterator<Item = (u32, u32)>) -> Vec<usize> {
        let met: Vec<Met> = hits
            .map(|(depth, element)| self.meet(line, depth, element))
            .collect();
        let by_number = |&a: &usize, &b: &usize| met[a].element.cmp(&met[b].element);
        let by_distance =
            |a: &usize, b: &usize| met[*a].s_m.total_cmp(&met[*b].s_m).then(by_number(a, b));
        let mut order: Vec<usize> = (0..met.len()).collect();
        order.sort_by(by_distance);
        let touch = |&a: &usize, &b: &usize| met[a].touches(&met[b], self.lattice.touch_m);
        for stack in order.chunk_by_mut(touch).filter(|stack| stack.len() > 1) {
            stack.sort_by(by_number);
            let lower = self.triangle(met[stack[0]].element);
            if !lower_first(&lower, self.lattice.direction) {
                stack.reverse();
            }
        }
        order
    }

    fn triangle(&self, element: u32) -> [DVec3; 3] {
        self.soup.triangle(self.elements.triangle(element))
    }

    /// Where a line meets an element at a depth that is known to a step.
    fn meet(&self, line: usize, depth: u32, element: u32) -> Met {
        let corners = self.triangle(element);
        let normal = geometry::doubled_area_vector(&corners).normalize_or_zero();
        let direction = self.lattice.direction;
        let along = normal.dot(direction);
        let s_of = |p: DVec3| p.z / direction.z;
        let s = corners.map(s_of);
        let (least, greatest) = (s[0].min(s[1]).min(s[2]), s[0].max(s[1]).max(s[2]));
        // of the copies of the triangle, one is met there
        let places = self.lattice.places_of((line, depth), &corners);
        let met = places.take(MOST_COPIES).map(|at| {
            let on_line = self.lattice.point_at(at.x, at.y, corners[0].z);
            s[0] + normal.dot(corners[0] - on_line) / along
        });
        let met = met.filter(|s_m| s_m.is_finite());
        let met = met.map(|s_m| s_m.clamp(least, greatest));
        let off = |s_m: &f64| self.lattice.depth(*s_m).abs_diff(depth);
        let best = met.min_by_key(off).filter(|s_m| off(s_m) <= CLOSE);
        Met {
            s_m: best.unwrap_or_else(|| self.lattice.s_of_depth_m(depth)),
            cosine: along.abs(),
            element,
        }
    }
}
