//! The tracer against a search through all triangles in f64, at edges, and where surfaces touch.

use std::sync::Arc;

use glam::DVec3;
use nestrad_common::geometry::{doubled_area_vector, point_within};
use proptest::prelude::*;

use super::meeting::Edges;
use super::tracer::Tracer;
use super::tree::FaceRay;
use crate::block::{Block, BlockFrame, TriangleRun};
use crate::lattice::Extent;
use crate::world::World;

/// A block of one element a triangle, with all of it in the box `min` to `max`.
fn block(triangles: &[[DVec3; 3]], [min, max]: [DVec3; 2], periodic: bool) -> Block {
    let n = triangles.len();
    let frame = BlockFrame {
        world: World {
            extent: Extent {
                min_m: min,
                max_m: max,
                periodic,
            },
            elements: n as u32,
            soil: None,
            radius_m: f64::INFINITY,
            far: None,
        },
        runs: vec![TriangleRun {
            triangles: n as u32,
            divisions: 1,
            owned: true,
            ..TriangleRun::default()
        }],
        owned_soil: Vec::new(),
    };
    Block::new(&frame, Arc::new(triangles.iter().copied().collect())).unwrap()
}

fn seen(tracer: &Tracer, block: &Block, origin: DVec3, direction: DVec3, source: u32) -> u32 {
    let ray = FaceRay {
        face: 2 * source,
        origin,
        direction: direction.normalize(),
        source: Some(source),
    };
    tracer.seen(block, &ray, 0.0)
}

/// An octahedron around the origin, each facet split in four `levels` times, looking inwards.
fn sphere(levels: u32) -> Vec<[DVec3; 3]> {
    let mut facets = Vec::new();
    for octant in 0..8 {
        let sign = |bit: u32| if octant >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        let outwards = sign(0) * sign(1) * sign(2) > 0.0;
        facets.push(if outwards { [y, x, z] } else { [x, y, z] });
    }
    for _ in 0..levels {
        facets = facets
            .into_iter()
            .flat_map(|[a, b, c]| {
                let middle = |u: DVec3, v: DVec3| (u + v).normalize();
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    facets
}

/// From points on every facet of a closed sphere exactly to the corners and the middles of the edges of
/// every facet: nothing is seen through any of them.
#[test]
fn rays_through_edges_and_corners_do_not_leave_a_closed_mesh() {
    for offset in [DVec3::ZERO, DVec3::new(5e5, 4.6e6, 2e3)] {
        let triangles: Vec<[DVec3; 3]> = sphere(3)
            .into_iter()
            .map(|t| t.map(|v| 0.37 * v + offset))
            .collect();
        let bounds = [offset - 0.37, offset + 0.37];
        let block = block(&triangles, bounds, false);
        let tracer = Tracer::new(&block);
        let (sky, void) = (
            block.local(block.ends.sky()),
            block.local(block.ends.void()),
        );
        let (mut leaks, mut rays) = (0, 0);
        for (s, from) in triangles.iter().enumerate().step_by(37) {
            let origin = 0.2 * from[0] + 0.3 * from[1] + 0.5 * from[2];
            for to in &triangles {
                for k in 0..3 {
                    for target in [to[k], 0.5 * (to[k] + to[(k + 1) % 3])] {
                        // in its own plane a ray leaves by its own edge
                        let normal = doubled_area_vector(from);
                        if normal.dot(target - origin).abs() < 1e-9 * normal.length() {
                            continue;
                        }
                        let end = seen(&tracer, &block, origin, target - origin, s as u32);
                        leaks += u32::from(end == sky || end == void);
                        rays += 1;
                    }
                }
            }
        }
        assert!(rays > 40_000 && leaks == 0, "{leaks} of {rays} at {offset}");
    }
}

/// Two leaves in one place lie as the lines have them, by rising number: the first one's upper face and
/// the second one's lower face see each other, the others see what is around.
#[test]
fn leaves_in_one_place_see_each_other_as_they_are_numbered() {
    let leaf = [
        DVec3::new(0.1, 0.2, 0.31),
        DVec3::new(0.9, 0.1, 0.47),
        DVec3::new(0.3, 0.8, 0.23),
    ];
    // the same corners from another one on
    let again = [leaf[1], leaf[2], leaf[0]];
    let block = block(&[leaf, again], [DVec3::ZERO, DVec3::ONE], false);
    let tracer = Tracer::new(&block);
    let (sky, void) = (
        block.local(block.ends.sky()),
        block.local(block.ends.void()),
    );
    for k in 0..50 {
        let (r1, r2) = (f64::from(k) / 50.0, (f64::from(k) * 0.618).fract());
        let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];
        let origin = point_within(&leaf, &corners, [r1, r2]);
        let up = DVec3::new(0.2, -0.1 * r1, 1.0);
        for (source, direction, expected) in [(0, up, 3), (0, -up, void), (1, up, sky), (1, -up, 0)]
        {
            let end = seen(&tracer, &block, origin, direction, source);
            assert_eq!(end, expected, "{source} {direction}");
        }
        // from above the second one is seen, from below the first one
        let far = |direction: DVec3| FaceRay {
            face: 0,
            origin: origin - 0.2 * direction,
            direction,
            source: None,
        };
        let up = up.normalize();
        assert_eq!(tracer.seen(&block, &far(up), 0.0), 1);
        assert_eq!(tracer.seen(&block, &far(-up), 0.0), 2);
    }
}

/// obvhs walks trees of a bounded depth.
#[test]
fn a_hundred_thousand_leaves_in_one_place_make_no_deep_tree() {
    let at = |x: f64| {
        [
            DVec3::X * x,
            DVec3::X * x + DVec3::Y,
            DVec3::Z + DVec3::X * x,
        ]
    };
    let mut triangles = vec![at(1.0)];
    triangles.extend(std::iter::repeat_n(at(0.0), 100_000));
    let block = block(&triangles, [DVec3::ZERO, DVec3::ONE], false);
    let tracer = Tracer::new(&block);
    let end = seen(&tracer, &block, DVec3::new(1.0, 0.2, 0.2), -DVec3::X, 0);
    assert!((2..200_002).contains(&end), "{end}");
}

/// Triangles of all sizes and shapes, flat ones too, in a box or repeated.
fn triangles() -> impl Strategy<Value = Vec<[DVec3; 3]>> {
    let corner = || (0.0f64..1.0, 0.0f64..1.0, 0.0f64..1.0);
    let triangle = (corner(), corner(), corner(), -6.0f64..0.0, 0usize..4).prop_map(
        |(a, b, c, size, flat)| {
            let [a, b, c] = [a, b, c].map(|(x, y, z)| DVec3::new(x, y, z));
            let scale = 10f64.powf(size);
            let mut t = [a, a + scale * (b - a), a + scale * (c - a)];
            if flat < 3 {
                // in a plane along the axes: its box has no thickness
                for v in &mut t {
                    v[flat] = a[flat];
                }
            }
            t
        },
    );
    proptest::collection::vec(triangle, 1..40)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    /// The boxes in f32 are padded by more than all rounding: no triangle that f64 finds is missed.
    #[test]
    fn f32_boxes_hide_nothing_that_f64_finds(
        triangles in triangles(), towards in proptest::collection::vec((0usize..40, 0.05f64..0.9, 0.05f64..0.9), 30),
        from in (0.0f64..1.0, 0.0f64..1.0, 0.0f64..1.0), size in -3.0f64..3.0, offset in -10.0f64..10.0,
    ) {
        let scale = 10f64.powf(size);
        let place = |v: DVec3| v * scale + scale * DVec3::new(offset, -offset, 0.1 * offset);
        let triangles: Vec<[DVec3; 3]> = triangles.into_iter().map(|t| t.map(place)).collect();
        let bounds = [place(DVec3::ZERO), place(DVec3::ONE)];
        let block = block(&triangles, bounds, false);
        let tracer = Tracer::new(&block);
        let origin = place(DVec3::from(from));
        for (k, u, v) in towards {
            // at triangles, so that most rays meet one
            let [a, b, c] = triangles[k % triangles.len()];
            let target = a + u * (b - a) + v * (1.0 - u) * (c - a);
            let Some(direction) = (target - origin).try_normalize() else { continue };
            let ray = FaceRay { face: 0, origin, direction, source: None };
            let found = tracer.seen(&block, &ray, 0.0);
            let edges = Edges::new(direction);
            let all: Vec<(f64, u32)> = triangles.iter().enumerate().filter_map(|(t, triangle)| {
                let hit = edges.meet(triangle, origin).filter(|hit| hit.t > 1e-9 * scale)?;
                Some((hit.t, 2 * t as u32 + u32::from(!hit.upper)))
            }).collect();
            let nearest = all.iter().map(|hit| hit.0).fold(f64::INFINITY, f64::min);
            // of those that are as near as rounding can tell, any will do
            let close = |hit: &&(f64, u32)| hit.0 <= nearest + 1e-9 * scale;
            let allowed: Vec<u32> = all.iter().filter(close).map(|hit| hit.1).collect();
            prop_assert!(allowed.is_empty() || allowed.contains(&found), "{found}, expected one of {allowed:?}");
        }
    }
}
