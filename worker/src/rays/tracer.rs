//! The nearest thing along a ray, in a scene that may repeat for ever.
//!
//! obvhs (CWBVH, f32) says which triangles a ray may meet; whether and where it meets them is
//! decided in f64 on the original vertices, with an edge test that leaves no gap between neighbours.

use std::time::Duration;

use glam::{DVec2, DVec3};
use nestrad_common::{elements, geometry};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray, RayHit};

use crate::block::Block;

/// The acceleration structure of a block.
pub struct Tracer {
    bvh: CwBvh,
    /// Local triangle and copy of each primitive, in the order of the tree's leaves.
    primitives: Vec<(u32, Shift)>,
    /// Tree units per metre: obvhs drops nodes nearer than 1e-4 of its units.
    scale: f64,
    centre: DVec3,
    z_min_m: f64,
    z_max_m: f64,
}

/// A copy of the scene: how many patterns it lies away in x and y.
type Shift = [i64; 2];

/// obvhs enters nodes no nearer than this, in its units.
const NEAREST_NODE: f64 = 1e-4;

/// Half the extent of the scene in tree units: large enough that `NEAREST_NODE` is below the rounding
/// of f32 coordinates, small enough that nothing overflows.
const HALF_EXTENT: f64 = 1e4;

/// A ray that has crossed this many patterns without a hit is taken to leave the canopy sideways.
const MOST_PATTERNS: usize = 100_000;

impl Tracer {
    /// Builds the tree over all triangles of the block and, with a pattern, over those copies of them
    /// that reach into it.
    pub fn new(block: &Block) -> Self {
        let extent = &block.extent;
        let (mut lo, mut hi) =
            geometry::bounds(block.soup.triangles().iter().flatten()).unwrap_or_default();
        let (z_min_m, z_max_m) = (lo.z, hi.z);
        if extent.periodic {
            (lo.x, lo.y, hi.x, hi.y) = (
                extent.min_m.x,
                extent.min_m.y,
                extent.max_m.x,
                extent.max_m.y,
            );
        }
        let centre = 0.5 * (lo + hi);
        let scale = HALF_EXTENT / (0.5 * (hi - lo)).max_element().max(f64::MIN_POSITIVE);
        // f32 rounding of a box and of a ray's origin, and the nodes that obvhs takes as passed
        let padding = HALF_EXTENT * f64::from(f32::EPSILON) * 4.0 + 2.0 * NEAREST_NODE;

        let mut primitives = Vec::with_capacity(block.soup.triangles().len());
        let mut boxes = Vec::with_capacity(block.soup.triangles().len());
        for (t, triangle) in block.soup.triangles().iter().enumerate() {
            let Some((a, b)) = geometry::bounds(triangle) else {
                continue;
            };
            for shift in copies(block, a.truncate(), b.truncate()) {
                let by = block.shift_m(shift);
                let tree = |p: DVec3| (p + by - centre) * scale;
                boxes.push(Aabb {
                    min: (tree(a) - padding).as_vec3a(),
                    max: (tree(b) + padding).as_vec3a(),
                });
                primitives.push((t as u32, shift));
            }
        }
        let bvh = build_cwbvh(
            &boxes,
            BvhBuildParams::medium_build(),
            &mut Duration::default(),
        );
        let primitives = bvh
            .primitive_indices
            .iter()
            .map(|&p| primitives[p as usize])
            .collect();
        Self {
            bvh,
            primitives,
            scale,
            centre,
            z_min_m,
            z_max_m,
        }
    }

    /// The local end that a ray from triangle `source` meets first.
    ///
    /// `random` in [0, 1) chooses between the two levels of the far field around a point.
    pub(crate) fn seen(&self, block: &Block, ray: &FaceRay, random: f64) -> u32 {
        let (origin, direction) = (ray.origin, ray.direction);
        let to_height = |z: f64| match direction.z {
            0.0 => f64::INFINITY,
            dz => (z - origin.z) / dz,
        };
        let soil_t = match &block.soil {
            // what lies under the soil sees nothing
            Some(soil) if origin.z < soil.z_m => return block.local(block.ends.void()),
            Some(soil) if direction.z < 0.0 => to_height(soil.z_m),
            _ => f64::INFINITY,
        };
        // past the top or bottom of the leaves there is nothing more to hit
        let limit = soil_t.min(self.reach_m(ray)).min(block.radius_m);
        match self.nearest(block, ray, limit) {
            Some((_, face)) if self.is_buried(block, ray, face) => {
                block.local(if block.is_inside(ray.face) {
                    block.ends.void()
                } else {
                    block.ends.buried()
                })
            }
            Some((_, face)) => face,
            None => beyond(block, origin, direction, soil_t, random),
        }
    }

    /// Whether a ray that sees `face` runs inside something solid (see `lines::burial`): the line it
    /// lies on meets the inside at both ends.
    fn is_buried(&self, block: &Block, ray: &FaceRay, face: u32) -> bool {
        let back = || {
            let reverse = FaceRay {
                direction: -ray.direction,
                ..*ray
            };
            self.nearest(block, &reverse, block.radius_m.min(self.reach_m(&reverse)))
        };
        let onwards = || {
            let limit = block.radius_m.min(self.reach_m(ray));
            let (t, _) = self.nearest(block, ray, limit)?;
            let next = FaceRay {
                origin: ray.origin + t * ray.direction,
                source: self.triangle_of(block, face),
                ..*ray
            };
            self.nearest(block, &next, limit - t)
        };
        let inside = |end: Option<(f64, u32)>| end.is_some_and(|(_, f)| block.is_inside(f));
        match (block.is_inside(ray.face), block.is_inside(face)) {
            (false, true) => inside(back()),
            (true, false) => inside(onwards()),
            (true, true) | (false, false) => false,
        }
    }

    /// How far a ray can go before it has passed all leaves, metres.
    fn reach_m(&self, ray: &FaceRay) -> f64 {
        let z = if ray.direction.z > 0.0 {
            self.z_max_m
        } else {
            self.z_min_m
        };
        if ray.direction.z == 0.0 {
            f64::INFINITY
        } else {
            (z - ray.origin.z) / ray.direction.z
        }
    }

    fn triangle_of(&self, block: &Block, face: u32) -> Option<u32> {
        block
            .first
            .partition_point(|&f| f <= face / 2)
            .checked_sub(1)
            .map(|t| t as u32)
    }

    fn nearest(&self, block: &Block, ray: &FaceRay, limit: f64) -> Option<(f64, u32)> {
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
        let mut best: Option<(f64, u32)> = None;
        let tree_ray = Ray::new(start, ray.direction.as_vec3a(), 0.0, reach.max(0.0));
        self.bvh
            .ray_traverse(tree_ray, &mut RayHit::none(), |_, p| {
                let (t, copy) = self.primitives[p];
                let away = [pattern[0] + copy[0], pattern[1] + copy[1]];
                if Some(t) == ray.source && away == [0, 0] {
                    return f32::INFINITY;
                }
                let Some(hit) = edges.meet(
                    &block.soup.triangles()[t as usize],
                    ray.origin - block.shift_m(away),
                ) else {
                    return f32::INFINITY;
                };
                let (first, n) = (block.first[t as usize], block.divisions[t as usize]);
                let nearer =
                    best.is_none_or(|(s, face)| hit.t < s || (hit.t == s && 2 * first < face));
                if hit.t <= 0.0 || hit.t > limit || !nearer {
                    return f32::INFINITY;
                }
                best = Some((
                    hit.t,
                    2 * (first + elements::piece(n, hit.b1, hit.b2)) + u32::from(!hit.upper),
                ));
                // a hair farther, so that rounding to f32 cannot hide a nearer triangle
                ((hit.t - entered) * self.scale) as f32 * (1.0 + 1e-6) + 2.0 * NEAREST_NODE as f32
            });
        best
    }
}

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

/// What is seen when no triangle is hit within reach.
fn beyond(block: &Block, origin: DVec3, direction: DVec3, soil_t: f64, random: f64) -> u32 {
    let ends = &block.ends;
    if soil_t.is_finite() && soil_t <= block.radius_m {
        let at = origin + soil_t * direction;
        return block.local(soil_cell(block, at).map_or(ends.outer_soil(), |c| ends.soil(c)));
    }
    let z = origin.z + block.radius_m * direction.z;
    let (bottom, top) = (block.extent.min_m.z, block.extent.max_m.z);
    if !z.is_finite() || z >= top || z <= bottom {
        return block.local(if direction.z < 0.0 {
            ends.void()
        } else {
            ends.sky()
        });
    }
    let last = ends.far_levels.saturating_sub(1);
    let level = (((z - bottom) / (top - bottom) * f64::from(last) + random) as u32).min(last);
    let bin = ends.far_bin(direction.z.abs());
    block.local(if direction.z < 0.0 {
        ends.far_from_below(bin, level)
    } else {
        ends.far_from_above(bin, level)
    })
}

/// Shifts by whole patterns that bring the box `a..b` into the pattern.
fn copies(block: &Block, a: DVec2, b: DVec2) -> Vec<Shift> {
    let extent = &block.extent;
    if !extent.periodic {
        return vec![[0, 0]];
    }
    let (min, max) = (extent.min_m.truncate(), extent.max_m.truncate());
    let size = max - min;
    let (first, last) = (((min - b) / size).ceil(), ((max - a) / size).floor());
    let mut shifts = Vec::new();
    for i in first.x as i64..=last.x as i64 {
        for j in first.y as i64..=last.y as i64 {
            shifts.push([i, j]);
        }
    }
    shifts
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

fn soil_cell(block: &Block, at: DVec3) -> Option<u32> {
    let soil = block.soil.as_ref()?;
    let k = ((at.truncate() - soil.min_m) / soil.cell_m).floor();
    let cells = DVec2::new(f64::from(soil.cells[0]), f64::from(soil.cells[1]));
    let k = if block.extent.periodic {
        k - (k / cells).floor() * cells
    } else {
        k
    };
    let inside = k.cmpge(DVec2::ZERO).all() && k.cmplt(cells).all();
    inside.then(|| k.y as u32 * soil.cells[0] + k.x as u32)
}

struct Meeting {
    t: f64,
    b1: f64,
    b2: f64,
    /// The ray arrives on the upper face.
    upper: bool,
}

/// Watertight ray-triangle test (Woop, Benthin & Wald 2013), in f64: both triangles at an edge
/// evaluate the same products, so a ray through the edge meets at least one of them.
struct Edges {
    axes: [usize; 3],
    shear: [f64; 3],
    /// The axes were swapped to keep their handedness.
    flipped: bool,
}

impl Edges {
    fn new(direction: DVec3) -> Self {
        let d = direction.to_array();
        let a = direction.abs();
        let kz = if a.x > a.y && a.x > a.z {
            0
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
        Self {
            axes: [kx, ky, kz],
            shear: [d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]],
            flipped: d[kz] < 0.0,
        }
    }

    fn meet(&self, triangle: &[DVec3; 3], origin: DVec3) -> Option<Meeting> {
        let [kx, ky, kz] = self.axes;
        let [sx, sy, sz] = self.shear;
        let [a, b, c] = triangle.map(|p| {
            let p = (p - origin).to_array();
            [p[kx] - sx * p[kz], p[ky] - sy * p[kz], sz * p[kz]]
        });
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) / det;
        Some(Meeting {
            t,
            b1: v / det,
            b2: w / det,
            upper: (det > 0.0) != self.flipped,
        })
    }
}
