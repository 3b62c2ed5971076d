//! Polygons to triangles: concave ones too, and those that are a little out of plane. What crosses itself, or
//! folds too much for its area to be known, is refused.

use std::f64::consts::{PI, TAU};

use earcut::Earcut;
use glam::{DVec2, DVec3};
use thiserror::Error;

/// A polygon of more vertices is taken for a garbled one.
pub const MAX_VERTICES: usize = 10_000;

/// How much more area the triangles of a polygon may have than the polygon has in its mean plane, in parts of that.
/// For a square this is one corner lifted by 0.7 of a side; the two ways to cut it then differ by 1.6 %.
pub const MAX_FOLD: f64 = 0.1;

/// This part of its width is no matter, nor this part of its area: a file's coordinates are rounded, and polygons at the
/// tips of leaves are narrow.
const ROUNDED: f64 = 1e-3;

/// What is nearer than this to touching, in parts of the width, touches: vertices that were turned from the
/// polygon's plane into ours are rounded.
const TOUCHING: f64 = 1e-9;

/// Twice the area of a polygon that is too narrow to be refused, in parts of its width squared.
const NEEDLE: f64 = 1e-4;

/// Areas below this, in parts of the width squared, are made of rounding.
const ROUNDING_AREA: f64 = 1e-13;

/// Why a polygon was refused. Vertices count from 1.
#[derive(Clone, Debug, Error, PartialEq)]
pub(super) enum PolygonFault {
    #[error("{:.0} % more", 100.0 * more)]
    Folded { more: f64 },
    #[error("one that folds over itself")]
    FoldsOver,
    #[error("a crossing of the edges that begin at vertex {} and at vertex {}", edges[0], edges[1])]
    Crosses { edges: [usize; 2] },
    #[error("one that overlaps itself")]
    Overlaps,
}

impl PolygonFault {
    /// What there should have been.
    pub(super) fn expected(&self) -> String {
        match self {
            Self::Folded { .. } | Self::FoldsOver => format!(
                "a nearly flat polygon, whose triangles have at most {} % more area than it has in its mean plane",
                100.0 * MAX_FOLD
            ),
            Self::Crosses { .. } | Self::Overlaps => {
                "a polygon whose edges do not cross".to_owned()
            }
        }
    }
}

/// Cuts polygons; keeps its memory from one to the next.
#[derive(Default)]
pub(super) struct Cutter {
    /// The polygon around 0, one unit wide.
    placed: Vec<DVec3>,
    /// The same in its mean plane, counter-clockwise.
    flat: Vec<DVec2>,
    earcut: Earcut<f64>,
    indices: Vec<u32>,
}

impl Cutter {
    /// The vertices of each triangle: of a polygon of n vertices n - 2, or fewer where a concave one has vertices
    /// on a straight line. They turn as the polygon does.
    ///
    /// Where all can be seen from the first vertex, the triangles are a fan around it.
    pub(super) fn cut(
        &mut self,
        polygon: &[DVec3],
    ) -> Result<impl ExactSizeIterator<Item = [usize; 3]>, PolygonFault> {
        self.indices.clear();
        if polygon.len() > 3 && self.place(polygon) {
            let is_flat = self.flatten();
            let turned_back = turned_back(&self.flat);
            if turned_back <= ROUNDING_AREA {
                self.fan_of(polygon.len());
            } else if let Err(fault) = self.clip_ears() {
                if turned_back > ROUNDED && !self.is_needle() {
                    return Err(if is_flat {
                        fault
                    } else {
                        PolygonFault::FoldsOver
                    });
                }
                self.indices.clear();
                self.fan_of(polygon.len());
            }
            if !is_flat {
                self.check_fold()?;
            }
        } else {
            self.fan_of(polygon.len());
        }
        let triangles = self.indices.chunks_exact(3);
        Ok(triangles.map(|t| [t[0] as usize, t[1] as usize, t[2] as usize]))
    }

    fn fan_of(&mut self, vertices: usize) {
        let fan = (1..).zip(2..vertices as u32);
        self.indices.extend(fan.flat_map(|(b, c)| [0, b, c]));
    }

    /// Moves the polygon to 0. False where the rounding of its coordinates could have made it of a straight line.
    fn place(&mut self, polygon: &[DVec3]) -> bool {
        let first = polygon[0];
        let sum: DVec3 = polygon.iter().map(|v| *v - first).sum();
        let centre = first + sum / polygon.len() as f64;
        let most = |of: fn(DVec3, DVec3) -> f64| {
            let values = polygon.iter().map(|v| of(*v, centre));
            values.fold(0.0, f64::max)
        };
        let width = 2.0 * most(|v, centre| v.distance(centre));
        if width == 0.0 {
            return false;
        }
        self.placed.clear();
        let placed = polygon.iter().map(|v| (*v - centre) / width);
        self.placed.extend(placed);
        let farthest = most(|v, _| v.abs().max_element());
        let rounding = 4.0 * f64::EPSILON * (farthest / width).max(1.0);
        self.fan_crosses().any(|cross| cross.length() > rounding)
    }

    /// Whether the polygon is so narrow that rounding may have crossed its edges.
    fn is_needle(&self) -> bool {
        self.fan_crosses().map(DVec3::length).sum::<f64>() <= NEEDLE
    }

    /// Twice the area vectors of the triangles around the first vertex.
    fn fan_crosses(&self) -> impl Iterator<Item = DVec3> {
        let first = self.placed[0];
        let edges = self.placed.windows(2).skip(1);
        edges.map(move |edge| (edge[0] - first).cross(edge[1] - first))
    }

    /// Lays the polygon into its mean plane, and says whether all of it is there.
    fn flatten(&mut self) -> bool {
        let sum: DVec3 = self.fan_crosses().sum();
        let of_all: f64 = self.fan_crosses().map(DVec3::length).sum();
        // a figure of eight may have no area, but it has a plane
        let normal = if sum.length() > TOUCHING * of_all {
            sum
        } else {
            let larger = |a: DVec3, b: DVec3| if b.length() > a.length() { b } else { a };
            self.fan_crosses().fold(DVec3::ZERO, larger)
        };
        let normal = normal.normalize();
        let (x, y) = normal.any_orthonormal_pair();
        self.flat.clear();
        let flat = self.placed.iter().map(|v| DVec2::new(v.dot(x), v.dot(y)));
        self.flat.extend(flat);
        let mut heights = self.placed.iter().map(|v| v.dot(normal));
        heights.all(|height| height.abs() <= ROUNDED)
    }

    /// Refuses what is folded so much that its area depends on how it is cut.
    fn check_fold(&self) -> Result<(), PolygonFault> {
        let n = self.flat.len();
        // a vertex above another edge, or on it
        if self.indices.len() != 3 * (n - 2) {
            return Err(PolygonFault::FoldsOver);
        }
        let folded = |area: f64, sum: DVec3| area / sum.length() - 1.0;
        let cut = self.indices.chunks_exact(3);
        let cut = cut.map(|t| [t[0], t[1], t[2]].map(|vertex| vertex as usize));
        let (area, sum) = self.areas(cut);
        let mut more = folded(area, sum);
        // another program might cut it from the next vertex on
        let mut turned = self.flat.clone();
        turned.rotate_left(1);
        if turned_back(&turned) <= ROUNDING_AREA {
            let (area, sum) = self.areas((2..n).map(|b| [1, b, (b + 1) % n]));
            more = more.max(folded(area, sum));
        }
        (more <= MAX_FOLD)
            .then_some(())
            .ok_or(PolygonFault::Folded { more })
    }

    /// Twice the area of triangles, and of their area vectors together.
    fn areas(&self, triangles: impl Iterator<Item = [usize; 3]>) -> (f64, DVec3) {
        let crosses = triangles.map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| self.placed[vertex]);
            (b - a).cross(c - a)
        });
        crosses.fold((0.0, DVec3::ZERO), |(area, sum), cross| {
            (area + cross.length(), sum + cross)
        })
    }

    fn clip_ears(&mut self) -> Result<(), PolygonFault> {
        let flat = &self.flat;
        if let Some(edges) = crossing(flat) {
            let edges = edges.map(|edge| edge + 1);
            return Err(PolygonFault::Crosses { edges });
        }
        let vertices = flat.iter().map(|v| v.to_array());
        self.earcut.earcut(vertices, &[], &mut self.indices);
        let mut area = 0.0;
        for triangle in self.indices.chunks_exact_mut(3) {
            let [a, b, c] = [0, 1, 2].map(|k| flat[triangle[k] as usize]);
            let doubled = (b - a).perp_dot(c - a);
            if doubled < 0.0 {
                triangle.swap(1, 2);
            }
            area += doubled.abs();
        }
        let enclosed: f64 = edges(flat).map(|(a, b)| a.perp_dot(b)).sum();
        let covered = (area - enclosed).abs() <= TOUCHING * area + ROUNDING_AREA;
        if !(enclosed > 0.0 && covered && turns_once(flat)) {
            return Err(PolygonFault::Overlaps);
        }
        Ok(())
    }
}

/// How much of the triangles around the first vertex turns back, in parts of what does not. Where nothing does, they
/// cover the polygon once; infinite where they come round to where they began.
fn turned_back(flat: &[DVec2]) -> f64 {
    let (mut around, mut forth, mut back) = (0.0, 0.0, 0.0);
    let mut last: Option<DVec2> = None;
    for &vertex in &flat[1..] {
        let to = vertex - flat[0];
        if to.length() <= TOUCHING {
            continue;
        }
        if let Some(from) = last {
            let doubled = from.perp_dot(to);
            forth += doubled.max(0.0);
            back -= doubled.min(0.0);
            around += from.angle_to(to).abs();
        }
        last = Some(to);
    }
    if around > TAU + ROUNDED {
        return f64::INFINITY;
    }
    back / forth
}

fn edges(flat: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> {
    let next = flat.iter().cycle().skip(1);
    flat.iter().copied().zip(next.copied())
}

/// Two edges that cross, or run along each other in the same direction, each by the vertex where it begins. Edges
/// may touch, and run back along each other: so are holes drawn.
fn crossing(flat: &[DVec2]) -> Option<[usize; 2]> {
    struct Edge {
        number: usize,
        from: DVec2,
        to: DVec2,
    }
    let numbered = edges(flat).enumerate();
    let edge = |(number, (from, to))| Edge { number, from, to };
    let mut sorted: Vec<Edge> = numbered.map(edge).collect();
    sorted.retain(|edge| edge.from.distance(edge.to) > TOUCHING);
    let low = |edge: &Edge| edge.from.x.min(edge.to.x);
    let high = |edge: &Edge| edge.from.x.max(edge.to.x);
    sorted.sort_by(|a, b| low(a).total_cmp(&low(b)));
    for (k, edge) in sorted.iter().enumerate() {
        let beside = |other: &&Edge| low(other) <= high(edge);
        for other in sorted[k + 1..].iter().take_while(beside) {
            if cross([edge.from, edge.to], [other.from, other.to]) {
                let mut found = [edge.number, other.number];
                found.sort_unstable();
                return Some(found);
            }
        }
    }
    None
}

fn cross(first: [DVec2; 2], second: [DVec2; 2]) -> bool {
    // how far to the left of a line a point is
    let left = |[a, b]: [DVec2; 2], p: DVec2| (b - a).normalize().perp_dot(p - a);
    let apart = |a: f64, b: f64| a.min(b) < -TOUCHING && a.max(b) > TOUCHING;
    let ends = second.map(|p| left(first, p));
    if ends.iter().all(|end| end.abs() <= TOUCHING) {
        let along = (first[1] - first[0]).normalize();
        let at = |p: DVec2| along.dot(p - first[0]);
        let [from, to] = second.map(at);
        return to > from && from.max(0.0) + TOUCHING < to.min(at(first[1]));
    }
    apart(ends[0], ends[1]) && {
        let ends = first.map(|p| left(second, p));
        apart(ends[0], ends[1])
    }
}

/// Whether the outline as a whole turns once to the left, as that of a polygon does which lies nowhere on itself.
fn turns_once(flat: &[DVec2]) -> bool {
    let steps = edges(flat).map(|(a, b)| b - a);
    let steps: Vec<DVec2> = steps.filter(|step| step.length() > TOUCHING).collect();
    let mut turned = 0.0;
    let mut back = 0;
    for (from, to) in edges(&steps) {
        let turn = from.angle_to(to);
        // a spike turns to the left or to the right: both may be
        if PI - turn.abs() <= TOUCHING {
            back += 1;
            turned += PI;
        } else {
            turned += turn;
        }
    }
    let times = (turned / TAU).round() as i64;
    (1..=1 + back).contains(&times)
}

#[cfg(test)]
#[path = "polygon_tests.rs"]
mod tests;
