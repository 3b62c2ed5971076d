//! The order of the faces that a line of a lattice meets in almost the same place (see `touch.rs`).

use glam::DVec3;
use nestrad_common::geometry;

use crate::elements::Elements;
use crate::lattice::{Lattice, Soup};
use crate::touch::lower_first;

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
