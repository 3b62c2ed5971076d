//! Closed surfaces: whatever is inside sees nothing else.

use glam::{DVec2, DVec3};

use crate::scenery::Scenery;

/// A sphere of radius 1 around (0, 0, 1): an octahedron, each facet split in four `levels` times.
/// Upper faces look outwards; organs `wall 0` to `wall 7` are octants.
pub fn sphere(levels: u32) -> Scenery {
    let mut scenery = Scenery::open();
    for octant in 0..8 {
        let sign = |bit: u32| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        let outwards = sign(0) * sign(1) * sign(2) > 0.0;
        let facet = if outwards { [x, y, z] } else { [y, x, z] };
        split(&mut scenery, &format!("wall {octant}"), facet, levels);
    }
    scenery
}

fn split(scenery: &mut Scenery, organ: &str, [a, b, c]: [DVec3; 3], levels: u32) {
    if levels == 0 {
        scenery.triangle(organ, [a, b, c].map(|v| v + DVec3::Z));
        return;
    }
    let middle = |u: DVec3, v: DVec3| (u + v).normalize();
    let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
    for facet in [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]] {
        split(scenery, organ, facet, levels - 1);
    }
}

/// A box from `min` of that `size`; upper faces look inwards. Organs `wall 0` (bottom) to `wall 5`.
pub fn closed_box(scenery: &mut Scenery, min: DVec3, size: DVec3) {
    let at = |x: f64, y: f64, z: f64| min + size * DVec3::new(x, y, z);
    let walls = [
        [
            at(0., 0., 0.),
            at(1., 0., 0.),
            at(1., 1., 0.),
            at(0., 1., 0.),
        ],
        [
            at(0., 0., 1.),
            at(0., 1., 1.),
            at(1., 1., 1.),
            at(1., 0., 1.),
        ],
        [
            at(0., 0., 0.),
            at(0., 0., 1.),
            at(1., 0., 1.),
            at(1., 0., 0.),
        ],
        [
            at(0., 1., 0.),
            at(1., 1., 0.),
            at(1., 1., 1.),
            at(0., 1., 1.),
        ],
        [
            at(0., 0., 0.),
            at(0., 1., 0.),
            at(0., 1., 1.),
            at(0., 0., 1.),
        ],
        [
            at(1., 0., 0.),
            at(1., 0., 1.),
            at(1., 1., 1.),
            at(1., 1., 0.),
        ],
    ];
    for (k, corners) in walls.into_iter().enumerate() {
        scenery.quad(&format!("wall {k}"), corners);
    }
}

/// A horizontal plate that fills a pattern exactly once, moved by `offset` past its edges.
pub fn full_plate(scenery: &mut Scenery, organ: &str, z_m: f64, offset_m: DVec2) {
    let size = scenery.pattern.unwrap().size_m;
    scenery.level(organ, offset_m.extend(z_m), size);
}
