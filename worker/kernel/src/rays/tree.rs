//! The nearest triangle along a ray, in a scene that may repeat for ever.
//!
//! obvhs (CWBVH, f32) says which triangles a ray may meet; whether and where it meets them is
//! decided in f64 on the original vertices, with an edge test that leaves no gap between neighbours.

use std::time::Duration;

use glam::{DVec2, DVec3, Vec3A};
use nestrad_common::geometry;
use obvhs::BvhBuildParams;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray, RayHit};

use super::boxes::{Boxes, Shift};
use super::meeting::Edges;
use crate::block::Block;
use crate::elements;
use crate::touch::{lower_first, touch_m};

/// A ray from a face.
#[derive(Clone, Copy)]
pub(crate) struct FaceRay {
    /// The local face, or soil cell, that it leaves.
    pub(crate) face: u32,
    pub(crate) origin: DVec3,
    /// Unit vector.
    pub(crate) direction: DVec3,
    /// The local triangle that it leaves, if it does not leave the soil; it cannot hit it again (but copies of it it can).
    pub(crate) source: Option<u32>,
}

/// An acceleration structure.
pub(super) struct Tree {
    bvh: CwBvh,
    /// Where the list of each leaf of the tree starts in `members`, and their number at the end.
    first_member: Vec<u32>,
    /// In the order in which the tree has them.
    members: Vec<Member>,
    /// Tree units per metre: obvhs drops nodes nearer than 1e-4 of its units.
    scale: f64,
    centre: DVec3,
    z_min_m: f64,
    z_max_m: f64,
    /// What lies closer together than this touches, metres, where it is near the ray's origin.
    pub(super) touch_m: f64,
    /// How far rounding carries a point near the ray's origin, metres.
    rounding_m: f64,
}

/// A triangle, or a copy of it, with its vertices: a ray that comes to a leaf of the tree reads on in one
/// place, since each other place would be a cache miss.
struct Member {
    vertices_m: [DVec3; 3],
    /// Local triangle and copy.
    place: (u32, Shift),
}

/// obvhs enters nodes no nearer than this, in its units.
const NEAREST_NODE: f64 = 1e-4;

/// Half the extent of the scene in tree units: large enough that `NEAREST_NODE` is below the rounding
/// of f32 coordinates, small enough that nothing overflows.
const HALF_EXTENT: f64 = 1e4;

/// Rounding of a box and of a ray to f32, in units of the last place of the extent: half a unit for each
/// of the ray's origin, its direction, the inverse of that, a difference and a product, over twice the
/// half extent.
const ROUNDINGS: f64 = 6.0;

/// How far rounding carries the place where a ray meets a triangle, in parts of the distance along the ray: a point
/// within a triangle is rounded four times, a copy one pattern away once by its user and once here, each in three
/// coordinates by at most half a unit in the last place: 6 sqrt(3) < 12 halves.
const ROUNDING: f64 = 12.0 * 0.5 * f64::EPSILON;

/// A ray that has crossed this many patterns without a hit is taken to leave the canopy sideways.
const MOST_PATTERNS: usize = 100_000;

impl Tree {
    /// Bytes that it takes.
    pub(super) fn bytes(&self) -> u64 {
        let of = |list: usize, item: usize| (list * item) as u64;
        size_of_val(&self.bvh.nodes[..]) as u64
            + of(
                self.first_member.len() + self.bvh.primitive_indices.len(),
                4,
            )
            + of(self.members.len(), size_of::<Member>())
    }

    /// Builds the tree over those triangles of the block that `keep` holds of and, with a pattern, over those
    /// copies of them that reach into it.
    pub(super) fn of(block: &Block, keep: impl Fn(usize) -> bool) -> Self {
        let extent = &block.extent;
        let (mut lo, mut hi) = geometry::bounds_of(block.soup.triangles()).unwrap_or_default();
        let (z_min_m, z_max_m) = (lo.z, hi.z);
        // rays begin on the soil too, which may reach far beyond the leaves
        (lo, hi) = (lo.min(extent.min_m), hi.max(extent.max_m));
        if extent.periodic {
            (lo.x, lo.y) = extent.min_m.truncate().into();
            (hi.x, hi.y) = extent.max_m.truncate().into();
        }
        let centre = 0.5 * (lo + hi);
        let scale = HALF_EXTENT / (0.5 * (hi - lo)).max_element().max(f64::MIN_POSITIVE);
        let touch_m = touch_m(extent.min_m, extent.max_m);
        let rounding_m = ROUNDING * lo.abs().max(hi.abs()).max_element();
        // and the nodes that obvhs takes as passed
        let padding = HALF_EXTENT * f64::from(f32::EPSILON) * ROUNDINGS + 2.0 * NEAREST_NODE;

        let tree = |p: DVec3| (p - centre) * scale;
        let Boxes {
            boxes,
            first_member,
            members,
        } = Boxes::of(block, keep, tree, padding);
        let bvh = build_cwbvh(
            &boxes,
            BvhBuildParams::medium_build(),
            &mut Duration::default(),
        );
        let mut in_order = Vec::with_capacity(members.len());
        let mut first_in_order = Vec::with_capacity(first_member.len());
        for &of_box in &bvh.primitive_indices {
            first_in_order.push(in_order.len() as u32);
            let of_box = of_box as usize;
            let list = first_member[of_box] as usize..first_member[of_box + 1] as usize;
            in_order.extend(members[list].iter().map(|&place| Member {
                vertices_m: block.soup.triangle(place.0 as usize),
                place,
            }));
        }
        first_in_order.push(in_order.len() as u32);
        Self {
            bvh,
            first_member: first_in_order,
            members: in_order,
            scale,
            centre,
            z_min_m,
            z_max_m,
            touch_m,
            rounding_m,
        }
    }

    /// How far a ray can go before it has passed all leaves, metres; a hair more, so that rounding does
    /// not lose what lies exactly at their top or bottom.
    pub(super) fn reach_m(&self, ray: &FaceRay) -> f64 {
        let z = if ray.direction.z > 0.0 {
            self.z_max_m
        } else {
            self.z_min_m
        };
        match ray.direction.z {
            0.0 => f64::INFINITY,
            dz => (z - ray.origin.z) / dz * (1.0 + 1e-9) + 1e-9 / dz.abs(),
        }
    }

    /// The nearest hit up to `limit`: its distance and the local face.
    pub(super) fn nearest(&self, block: &Block, ray: &FaceRay, limit: f64) -> Option<(f64, u32)> {
        if !block.extent.periodic {
            return self.nearest_in_pattern(block, ray, [0, 0], 0.0, limit);
        }
        // from pattern to pattern, in the order in which the ray crosses them
        let (min, max) = (block.extent.min_m.truncate(), block.extent.max_m.truncate());
        let at = ((ray.origin.truncate() - min) / (max - min)).floor();
        let mut pattern = [at.x as i64, at.y as i64];
        let mut entered = 0.0;
        for _ in 0..MOST_PATTERNS {
            let home = ray.origin - block.shift_m(pattern);
            let (leaves, step) = exit(home, ray.direction, min, max);
            match self.nearest_in_pattern(block, ray, pattern, entered, limit) {
                // what is hit farther on may be hidden by copies that do not reach into this pattern
                Some((t, face)) if t <= leaves => return Some((t, face)),
                _ if leaves >= limit => return None,
                _ => {}
            }
            pattern = [pattern[0] + step[0], pattern[1] + step[1]];
            entered = leaves;
        }
        None
    }

    /// The nearest hit up to `limit` of all that reaches into a pattern, which the ray enters at
    /// distance `entered`.
    fn nearest_in_pattern(
        &self,
        block: &Block,
        ray: &FaceRay,
        pattern: Shift,
        entered: f64,
        limit: f64,
    ) -> Option<(f64, u32)> {
        let home = ray.origin - block.shift_m(pattern);
        let start = ((home + entered * ray.direction - self.centre) * self.scale).as_vec3a();
        let reach = (((limit - entered) * self.scale) as f32) * (1.0 + 1e-5) + 1.0;
        let edges = Edges::new(ray.direction);
        let up = ray.direction.z >= 0.0;
        let mut best: Option<Hit> = None;
        let tree_ray = Ray::new(start, tree_direction(ray.direction), 0.0, reach.max(0.0));
        self.bvh
            .ray_traverse(tree_ray, &mut RayHit::none(), |_, leaf| {
                let members =
                    self.first_member[leaf] as usize..self.first_member[leaf + 1] as usize;
                let mut nearest = f64::INFINITY;
                for &Member {
                    ref vertices_m,
                    place: (t, copy),
                } in &self.members[members]
                {
                    let away = [pattern[0] + copy[0], pattern[1] + copy[1]];
                    let place = (t, away);
                    if Some(place) == ray.source.map(|t| (t, [0, 0])) {
                        continue;
                    }
                    let Some(mut hit) = edges.meet(vertices_m, ray.origin - block.shift_m(away))
                    else {
                        continue;
                    };
                    let source = ray.source.map(|t| (t, block.soup.triangle(t as usize)));
                    let left = source.as_ref().map(|(_, left)| left);
                    if self.touch(hit.t, hit.t, ray.direction, (vertices_m, left)) {
                        // it touches what the ray leaves
                        let ahead = match source {
                            Some((source, left)) => {
                                let moved = vertices_m.map(|v| v + block.shift_m(away));
                                let higher = place > (source, [0, 0]);
                                let lower = if higher { &left } else { vertices_m };
                                self.passes(&moved, &left, ray.direction)
                                    .unwrap_or_else(|| higher == lower_first(lower, ray.direction))
                            }
                            None => up,
                        };
                        if !ahead {
                            continue;
                        }
                        hit.t = 0.0;
                    } else if hit.t < 0.0 {
                        continue;
                    }
                    let nearer = best.as_ref().is_none_or(|best| {
                        let other = block.soup.triangle(best.place.0 as usize);
                        let both = (vertices_m, Some(&other));
                        if self.touch(hit.t - best.t, hit.t, ray.direction, both) {
                            let is_lower = place < best.place;
                            let lower = if is_lower { vertices_m } else { &other };
                            is_lower == lower_first(lower, ray.direction)
                        } else {
                            hit.t < best.t
                        }
                    });
                    if hit.t > limit || !nearer {
                        continue;
                    }
                    let cut = &block.elements;
                    let (first, n) = (cut.first[t as usize], cut.divisions[t as usize]);
                    best = Some(Hit {
                        t: hit.t,
                        place,
                        face: 2 * (first + elements::piece(n, hit.b1, hit.b2))
                            + u32::from(!hit.upper),
                    });
                    nearest = hit.t;
                }
                // a hair farther, so that rounding to f32 cannot hide a nearer triangle
                ((nearest - entered) * self.scale) as f32 * (1.0 + 1e-6) + 2.0 * NEAREST_NODE as f32
            });
        best.map(|hit| (hit.t, hit.face))
    }

    /// Whether a ray passes a triangle on its way from a triangle `left` that touches it: it does when it
    /// leaves the side on which `left` stands, as at an edge that the two share. `None` if they lie in one plane.
    fn passes(&self, triangle: &[DVec3; 3], left: &[DVec3; 3], direction: DVec3) -> Option<bool> {
        let normal = geometry::doubled_area_vector(triangle);
        let stands = |v: &DVec3| normal.dot(*v - triangle[0]);
        let sides = left.each_ref().map(stands);
        let side = sides.into_iter().fold(
            0.0,
            |far: f64, side| {
                if side.abs() > far.abs() { side } else { far }
            },
        );
        let in_plane = side.abs() <= 2.0 * self.touch_m * normal.length();
        (!in_plane).then(|| side * normal.dot(direction) < 0.0)
    }

    /// Whether two triangles touch that a ray meets so far apart, about `t` from its origin. Without a second one, what
    /// is met first is the soil.
    fn touch(
        &self,
        apart: f64,
        t: f64,
        direction: DVec3,
        (triangle, other): (&[DVec3; 3], Option<&[DVec3; 3]>),
    ) -> bool {
        let rounding = ROUNDING * t.abs();
        let (apart, touch_m) = (apart.abs(), self.touch_m + rounding);
        // far beyond any rounding no cosine need be known
        if apart > touch_m / SMALLEST_COSINE {
            return false;
        }
        let cosine = |triangle: &[DVec3; 3]| {
            let normal = geometry::doubled_area_vector(triangle);
            (normal.dot(direction) / normal.length())
                .abs()
                .max(SMALLEST_COSINE)
        };
        let of_it = cosine(triangle);
        let of_other = other.map_or(direction.z.abs(), cosine);
        // a ray along a surface is not known to meet it to better than this
        apart * of_it <= self.rounding_m + rounding || apart * of_it.max(of_other) <= touch_m
    }
}

/// A direction for obvhs, which loses boxes along a ray that is exactly parallel to an axis: infinity times
/// zero is no number.
fn tree_direction(direction: DVec3) -> Vec3A {
    let along = |d: f32| if d.abs() < 1e-12 { 1e-12 } else { d };
    let d = direction.as_vec3a();
    Vec3A::new(along(d.x), along(d.y), along(d.z))
}

/// Surfaces that are met at a smaller angle than this are not asked whether they touch.
const SMALLEST_COSINE: f64 = 1e-6;

/// The nearest triangle so far.
struct Hit {
    t: f64,
    /// Triangle and copy.
    place: (u32, Shift),
    face: u32,
}

/// Where a ray that is in the rectangle leaves it, and by which step of the pattern.
fn exit(home: DVec3, direction: DVec3, min: DVec2, max: DVec2) -> (f64, Shift) {
    let side = |p: f64, d: f64, lo: f64, hi: f64| match d {
        d if d > 0.0 => (((hi - p) / d).max(0.0), 1),
        d if d < 0.0 => (((lo - p) / d).max(0.0), -1),
        _ => (f64::INFINITY, 0),
    };
    let (tx, sx) = side(home.x, direction.x, min.x, max.x);
    let (ty, sy) = side(home.y, direction.y, min.y, max.y);
    if tx <= ty {
        (tx, [sx, 0])
    } else {
        (ty, [0, sy])
    }
}
