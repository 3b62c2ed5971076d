//! What a ray from a face sees.

use glam::DVec3;
use nestrad_common::geometry;

use super::tree::{FaceRay, Tree};
use crate::block::Block;
use crate::far_grid::Passage;

/// The acceleration structures of a block.
pub struct Tracer {
    all: Tree,
    /// What is the surface of something solid, where anything is.
    solids: Option<Solids>,
}

struct Solids {
    tree: Tree,
    /// Nothing is longer, metres.
    longest_m: f64,
}

impl Tracer {
    /// Builds them.
    pub fn new(block: &Block) -> Self {
        let is_solid = |t: usize| block.is_solid(2 * block.elements.first[t]);
        let triangles = block.soup.triangles().enumerate();
        let solid = triangles.filter(|&(t, _)| is_solid(t));
        let bounds = geometry::bounds_of(solid.map(|(_, triangle)| triangle));
        Self {
            all: Tree::of(block, |_| true),
            solids: bounds.map(|(lo, hi)| Solids {
                tree: Tree::of(block, is_solid),
                longest_m: (hi - lo).length() * (1.0 + 1e-9),
            }),
        }
    }

    /// Bytes that they take.
    pub fn bytes(&self) -> u64 {
        self.all.bytes() + self.solids.as_ref().map_or(0, |solids| solids.tree.bytes())
    }

    /// Whether a point of a triangle and element sees the sky in a direction that points up, however far away
    /// that is. The block is a whole scene.
    pub fn sees_sky(
        &self,
        block: &Block,
        (triangle, element): (u32, u32),
        origin: DVec3,
        direction: DVec3,
    ) -> bool {
        let normal = geometry::doubled_area_vector(&block.soup.triangle(triangle as usize));
        let ray = FaceRay {
            face: 2 * element + u32::from(normal.dot(direction) < 0.0),
            origin,
            direction,
            source: Some(triangle),
        };
        self.seen_within(block, &ray, 0.0, f64::INFINITY) == block.local(block.ends.sky())
    }

    /// The local end that a ray from triangle `source` meets first.
    ///
    /// `random` in [0, 1) chooses between far ends around a point.
    pub(crate) fn seen(&self, block: &Block, ray: &FaceRay, random: f64) -> u32 {
        self.seen_within(block, ray, random, block.radius_m)
    }

    /// The same within a sphere of that radius.
    fn seen_within(&self, block: &Block, ray: &FaceRay, random: f64, radius_m: f64) -> u32 {
        let (origin, direction) = (ray.origin, ray.direction);
        let to_height = |z: f64| match direction.z {
            0.0 => f64::INFINITY,
            dz => (z - origin.z) / dz,
        };
        let soil_t = match &block.soil {
            // what lies under the soil gets no light
            Some(soil) if origin.z < soil.z_m - self.all.touch_m => {
                return block.local(block.ends.buried());
            }
            Some(soil) if direction.z < 0.0 => to_height(soil.z_m),
            _ => f64::INFINITY,
        };
        // what touches the soil lies on it
        let soil_limit = soil_t + self.all.touch_m / direction.z.abs();
        // past the top or bottom of the leaves there is nothing more to hit
        let limit = soil_limit.min(self.all.reach_m(ray)).min(radius_m);
        match self.all.nearest(block, ray, limit) {
            Some((_, face)) if self.is_buried(block, ray, face, radius_m) => {
                block.local(if block.is_inside(ray.face) {
                    block.ends.void()
                } else {
                    block.ends.buried()
                })
            }
            Some((_, face)) => face,
            None => beyond(block, ray, soil_t, (random, radius_m)),
        }
    }

    /// Whether a ray that sees `face` runs inside something solid (see `lines::burial`): whatever leaves lie
    /// there, the line it lies on meets the inside of something solid first at both ends.
    fn is_buried(&self, block: &Block, ray: &FaceRay, face: u32, radius_m: f64) -> bool {
        let Some(solids) = self.solids.as_ref().filter(|_| block.is_face(ray.face)) else {
            return false;
        };
        let from_inside = block.is_inside(ray.face);
        if block.is_solid(ray.face) && (!from_inside || block.is_inside(face)) {
            return false;
        }
        let inside = |direction: DVec3, limit: f64| {
            let ray = FaceRay { direction, ..*ray };
            let limit = limit.min(solids.tree.reach_m(&ray));
            let (t, face) = solids.tree.nearest(block, &ray, limit)?;
            block.is_inside(face).then_some(t)
        };
        let longest = radius_m.min(solids.longest_m);
        inside(ray.direction, longest)
            .is_some_and(|ahead| from_inside || inside(-ray.direction, longest - ahead).is_some())
    }
}

/// What is seen when no triangle is hit within reach.
fn beyond(block: &Block, ray: &FaceRay, soil_t: f64, (random, radius_m): (f64, f64)) -> u32 {
    let (ends, direction) = (&block.ends, ray.direction);
    if let Some(ground) = &block.ground
        && soil_t.is_finite()
        && soil_t <= radius_m
    {
        let at = ray.origin + soil_t * direction;
        return block.local(ground.end_at(at.truncate()));
    }
    let z = ray.origin.z + radius_m * direction.z;
    let (bottom, top) = (block.extent.min_m.z, block.extent.max_m.z);
    let grid = block
        .far
        .as_ref()
        .filter(|_| z.is_finite() && z < top && z > bottom);
    let Some(grid) = grid else {
        return block.local(if direction.z < 0.0 {
            ends.void()
        } else {
            ends.sky()
        });
    };
    block.local(ends.far(grid.end_at(&Passage {
        height: (z - bottom) / (top - bottom),
        at_m: &|| (ray.origin + radius_m * direction).truncate(),
        direction_z: direction.z,
        random,
    })))
}
