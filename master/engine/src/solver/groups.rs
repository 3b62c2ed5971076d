//! Elements put together with their neighbours: what the solution would be made of if elements were larger.

use glam::DVec3;
use nestrad_common::geometry;
use nestrad_kernel::elements::piece_corners;
use rayon::prelude::*;

use super::soil_groups::SoilGroups;
use crate::frame::Frame;

/// Which rows share one radiosity when elements are about twice as wide.
#[derive(Clone, Debug)]
pub struct Groups {
    /// The group of each face.
    pub(super) of_face: Vec<u32>,
    /// How many groups there are.
    pub(super) len: usize,
    /// How much wider groups are than elements: the root of how many elements of equal size a group holds, on
    /// average over the area.
    pub(super) wider: f64,
    /// Those of the soil.
    pub(super) soil: SoilGroups,
}

/// A group is cut in two while it holds more than this many elements, small ones counting for little.
const MOST_ELEMENTS: f64 = 5.0;

/// An element: where it is, and where it looks to, in a length that makes both alike.
#[derive(Clone, Copy)]
struct Piece {
    at: [f64; 6],
    area_m2: f64,
    /// Its number within the organ.
    element: usize,
}

impl Groups {
    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        let of_soil = self.soil.ways.iter().map(|way| size_of_val(&way[..]));
        (size_of_val(&self.of_face[..]) + of_soil.sum::<usize>()) as u64
    }

    /// Groups the elements of each organ, faces of one side together, and the soil.
    ///
    /// The triangles of an organ have to lie one after the other, as the frame has them.
    pub fn of(frame: &Frame) -> Self {
        let of_organs: Vec<OfOrgan> = organs(frame)
            .into_par_iter()
            .map(|elements| OfOrgan::of(frame, elements))
            .collect();
        let mut groups = Self {
            of_face: Vec::with_capacity(frame.ends.faces() as usize),
            len: 0,
            wider: 1.0,
            soil: SoilGroups::of(frame),
        };
        let (mut area_m2, mut pieces_m2) = (0.0, 0.0);
        for organ in &of_organs {
            let first = groups.len as u32;
            for group in &organ.of_element {
                groups
                    .of_face
                    .extend([first + 2 * group, first + 2 * group + 1]);
            }
            groups.len += 2 * organ.groups;
            area_m2 += organ.area_m2;
            pieces_m2 += organ.pieces_m2;
        }
        if area_m2 > 0.0 {
            groups.wider = (pieces_m2 / area_m2).sqrt();
        }
        groups
    }
}

/// The elements of each organ.
fn organs(frame: &Frame) -> Vec<std::ops::Range<usize>> {
    let mut ranges: Vec<std::ops::Range<usize>> = Vec::new();
    let mut last = None;
    for (e, &t) in frame.triangle_of_element.iter().enumerate() {
        let organ = frame.organ[t as usize];
        match ranges.last_mut() {
            Some(range) if last == Some(organ) => range.end = e + 1,
            _ => ranges.push(e..e + 1),
        }
        last = Some(organ);
    }
    ranges
}

/// The groups of an organ.
struct OfOrgan {
    of_element: Vec<u32>,
    groups: usize,
    area_m2: f64,
    /// Sum over groups of their area times the number of elements of equal size.
    pieces_m2: f64,
}

impl OfOrgan {
    fn of(frame: &Frame, elements: std::ops::Range<usize>) -> Self {
        let areas = &frame.area_m2[elements.clone()];
        let (area_m2, squares) = sums(areas.iter().copied());
        let size_m = if area_m2 > 0.0 {
            (squares / area_m2).sqrt()
        } else {
            0.0
        };
        let piece = |(k, e): (usize, usize)| Piece {
            at: place(frame, e, size_m),
            area_m2: areas[k],
            element: k,
        };
        let mut pieces: Vec<Piece> = elements.enumerate().map(piece).collect();
        let mut organ = Self {
            of_element: vec![0; pieces.len()],
            groups: 0,
            area_m2,
            pieces_m2: 0.0,
        };
        organ.cut(&mut pieces);
        organ
    }

    /// Halves pieces across their longest extent until few enough are left.
    fn cut(&mut self, pieces: &mut [Piece]) {
        let (area_m2, squares) = sums(pieces.iter().map(|p| p.area_m2));
        let count = if squares > 0.0 {
            area_m2 * area_m2 / squares
        } else {
            1.0
        };
        if count <= MOST_ELEMENTS || pieces.len() < 2 {
            for piece in pieces {
                self.of_element[piece.element] = self.groups as u32;
            }
            self.groups += 1;
            self.pieces_m2 += area_m2 * count;
            return;
        }
        let axis = longest(pieces);
        pieces.sort_unstable_by(|a, b| {
            let by_place = a.at[axis].total_cmp(&b.at[axis]);
            by_place.then(a.element.cmp(&b.element))
        });
        let mut so_far = 0.0;
        let half = pieces.iter().position(|p| {
            so_far += p.area_m2;
            so_far >= 0.5 * area_m2
        });
        let at = half.map_or(1, |k| k + 1).clamp(1, pieces.len() - 1);
        let (one, other) = pieces.split_at_mut(at);
        self.cut(one);
        self.cut(other);
    }
}

/// The axis along which pieces lie farthest apart.
fn longest(pieces: &[Piece]) -> usize {
    let extent = |axis: usize| {
        let at = pieces.iter().map(|p| p.at[axis]);
        at.clone().fold(f64::NEG_INFINITY, f64::max) - at.fold(f64::INFINITY, f64::min)
    };
    (0..6).fold(0, |longest, axis| {
        if extent(axis) > extent(longest) {
            axis
        } else {
            longest
        }
    })
}

fn sums(areas: impl Iterator<Item = f64>) -> (f64, f64) {
    areas.fold((0.0, 0.0), |(sum, squares), a| (sum + a, squares + a * a))
}

/// The centre of an element and its normal, which is as long as an element is wide: the two sides of a stalk
/// are as far apart as elements side by side.
fn place(frame: &Frame, element: usize, size_m: f64) -> [f64; 6] {
    let t = frame.triangle_of_element[element];
    let (triangle, (piece, n)) = frame.piece(element, t);
    let [a, b, c] = triangle;
    let corners = piece_corners(n, piece);
    let [b1, b2] = [
        corners.iter().map(|c| c.0).sum::<f64>() / 3.0,
        corners.iter().map(|c| c.1).sum::<f64>() / 3.0,
    ];
    let centre: DVec3 = a + (b - a) * b1 + (c - a) * b2;
    let normal = geometry::doubled_area_vector(&triangle).normalize_or_zero() * size_m;
    [centre.x, centre.y, centre.z, normal.x, normal.y, normal.z]
}
