use super::*;
use glam::{DMat3, dvec2};
use proptest::prelude::*;

/// An L of three unit squares, counter-clockwise.
const L: [[f64; 2]; 6] = [
    [0.0, 0.0],
    [2.0, 0.0],
    [2.0, 1.0],
    [1.0, 1.0],
    [1.0, 2.0],
    [0.0, 2.0],
];

fn raised(flat: &[[f64; 2]]) -> Vec<DVec3> {
    let raised = flat.iter().map(|&[x, y]| DVec3::new(x, y, 0.0));
    raised.collect()
}

/// The area vectors of a polygon's triangles.
fn areas(polygon: &[DVec3]) -> Result<Vec<DVec3>, PolygonFault> {
    let mut cutter = Cutter::default();
    let triangles = cutter.cut(polygon)?.map(|t| t.map(|v| polygon[v]));
    Ok(triangles
        .map(|[a, b, c]| 0.5 * (b - a).cross(c - a))
        .collect())
}

fn indices(polygon: &[DVec3]) -> Vec<[usize; 3]> {
    Cutter::default().cut(polygon).unwrap().collect()
}

fn refusal(flat: &[[f64; 2]]) -> PolygonFault {
    areas(&raised(flat)).unwrap_err()
}

/// Whether the triangles have that area in all, and all look to one side.
fn covers(polygon: &[DVec3], area: f64, normal: DVec3, tolerance: f64) {
    let found = areas(polygon).unwrap();
    assert!(found.len() <= polygon.len() - 2);
    for one in &found {
        assert!(one.dot(normal) > -tolerance, "{found:?}");
    }
    let sum: f64 = found.iter().map(|one| one.length()).sum();
    assert!((sum - area).abs() <= tolerance, "{sum} {area}");
}

#[test]
fn fault_an_l_was_cut_as_a_fan_of_area_4() {
    let planes = [
        DMat3::IDENTITY,
        DMat3::from_rotation_x(1.1),
        DMat3::from_rotation_y(PI),
        DMat3::from_rotation_z(0.3) * DMat3::from_rotation_x(-2.0),
    ];
    for plane in planes {
        for first in 0..L.len() {
            let mut turned = L;
            turned.rotate_left(first);
            let flat = raised(&turned);
            for (scale, away, tolerance) in [
                (1.0, 0.0, 1e-14),
                (1e-3, 0.0, 1e-20),
                (1e6, 0.0, 1e-2),
                (1e-2, 9e5, 1e-10),
            ] {
                let place = |v: &DVec3| scale * (plane * *v) + DVec3::splat(away);
                let mut polygon: Vec<DVec3> = flat.iter().map(place).collect();
                let normal = plane * DVec3::Z;
                covers(&polygon, 3.0 * scale * scale, normal, tolerance);
                polygon.reverse();
                covers(&polygon, 3.0 * scale * scale, -normal, tolerance);
            }
        }
    }
}

#[test]
fn what_the_first_vertex_sees_is_a_fan_around_it() {
    let fan = vec![[0, 1, 2], [0, 2, 3], [0, 3, 4]];
    let convex = [[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [1.0, 2.0], [-1.0, 1.0]];
    assert_eq!(indices(&raised(&convex)), fan);
    let concave = [[0.0, 0.0], [3.0, -1.0], [1.0, 0.5], [3.0, 2.0], [-1.0, 2.0]];
    assert_eq!(indices(&raised(&concave)), fan);
    // a vertex on a straight line, and one that is given twice
    let straight = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 0.0]];
    assert_eq!(indices(&raised(&straight)), fan);
    let line = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [0.5, 0.0], [0.0, 0.0]];
    assert_eq!(indices(&raised(&line)), fan);
    assert_eq!(indices(&raised(&[[1.0, 1.0]; 5])), fan);
}

#[test]
fn a_hole_is_drawn_by_a_cut_that_is_gone_along_twice() {
    let frame = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 4.0],
        [0.0, 4.0],
        [0.0, 0.0],
        [1.0, 1.0],
        [1.0, 3.0],
        [3.0, 3.0],
        [3.0, 1.0],
        [1.0, 1.0],
    ];
    covers(&raised(&frame), 12.0, DVec3::Z, 1e-14);
    let turned = DMat3::from_rotation_x(0.7) * DMat3::from_rotation_y(0.4);
    let polygon: Vec<DVec3> = raised(&frame).iter().map(|v| turned * *v).collect();
    covers(&polygon, 12.0, turned * DVec3::Z, 1e-12);
}

#[test]
fn fault_a_polygon_that_crosses_itself_was_cut_as_a_fan() {
    let crosses = |edges| PolygonFault::Crosses { edges };
    let bow_tie = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
    assert_eq!(refusal(&bow_tie), crosses([1, 3]));
    let uneven = [[0.0, 0.0], [3.0, 2.0], [3.0, 0.0], [0.0, 1.0]];
    assert_eq!(refusal(&uneven), crosses([1, 3]));
    let star = [0.0_f64, 2.0, 4.0, 1.0, 3.0].map(|k| {
        let (sin, cos) = (TAU * k / 5.0).sin_cos();
        [cos, sin]
    });
    assert!(matches!(refusal(&star), PolygonFault::Crosses { .. }));
    // an arm that comes round and lies on the body
    let arm = [
        [0.0, 0.0],
        [6.0, 0.0],
        [6.0, 4.0],
        [-1.0, 4.0],
        [-1.0, 1.0],
        [2.0, 1.0],
        [2.0, 2.0],
        [0.5, 2.0],
        [0.5, 3.0],
        [5.0, 3.0],
        [5.0, 1.5],
        [0.0, 1.5],
    ];
    assert!(matches!(refusal(&arm), PolygonFault::Crosses { .. }));
    // a square gone around twice
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    assert_eq!(refusal(&[square, square].concat()), crosses([1, 5]));
    // there and back, and a loop that crosses in a vertex
    let back = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 0.0]];
    assert_eq!(refusal(&back), PolygonFault::Overlaps);
    let eight = [
        [0.0, 0.0],
        [1.0, 1.0],
        [3.0, 3.0],
        [3.0, -1.0],
        [1.0, 1.0],
        [0.0, 2.0],
    ];
    assert_eq!(refusal(&eight), PolygonFault::Overlaps);
    // a smaller loop inside a larger one, from a common vertex
    let loops = [
        [0.0, 0.0],
        [4.0, 0.0],
        [0.0, 4.0],
        [0.0, 0.0],
        [2.0, 1.0],
        [1.0, 2.0],
    ];
    assert_eq!(refusal(&loops), PolygonFault::Overlaps);
}

#[test]
fn a_polygon_may_fold_until_its_area_is_uncertain() {
    // a square with one corner lifted, begun at any of its vertices
    let lifted = |height: f64, first: usize| {
        let mut polygon = raised(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        polygon[2].z = height;
        polygon.rotate_left(first);
        areas(&polygon)
    };
    for first in 0..4 {
        let area: f64 = lifted(0.7, first).unwrap().iter().map(|a| a.length()).sum();
        let ways = [1.49_f64.sqrt(), 0.5 + 0.5 * 1.98_f64.sqrt()];
        assert!((area - ways[first % 2]).abs() < 1e-12, "{area}");
        assert!((ways[0] / ways[1] - 1.014).abs() < 1e-3);
        for height in [0.8, 1.0, 3.0, 100.0] {
            let fault = lifted(height, first).unwrap_err();
            assert!(matches!(fault, PolygonFault::Folded { more } if more > 0.1));
        }
    }
    // a strip that is folded over
    let mut strip = raised(&[
        [0.0, 0.0],
        [3.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [3.0, 1.0],
        [0.0, 1.0],
    ]);
    strip[2].z = 0.2;
    strip[3].z = 0.2;
    assert_eq!(areas(&strip).unwrap_err(), PolygonFault::FoldsOver);
}

#[test]
fn rounded_coordinates_are_no_fault() {
    // the tip of a leaf, crossed by rounding, and out of the plane of its base
    let tip = raised(&[[0.0, 0.0], [0.01, 0.0], [0.004999, 0.02], [0.005, 0.02]]);
    assert_eq!(indices(&tip), [[0, 1, 2], [0, 2, 3]]);
    let needle = [[0.0, 0.0], [0.1, 0.0], [0.1, 1e-6], [0.0, 1e-6]];
    let mut needle = raised(&needle);
    needle[2].z = 2e-6;
    assert_eq!(indices(&needle), [[0, 1, 2], [0, 2, 3]]);
    let crossed = raised(&[[0.0, 0.0], [0.1, 0.0], [0.1, -1e-6], [0.0, 1e-6]]);
    assert_eq!(indices(&crossed), [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn many_vertices_take_no_long_time() {
    let comb = (0..MAX_VERTICES / 2 - 1).flat_map(|k| {
        let x = k as f64;
        [[x, 0.1], [x + 0.5, 1.0]]
    });
    let comb: Vec<[f64; 2]> = [[-1.0, -1.0], [1e4, -1.0]]
        .into_iter()
        .chain(comb.collect::<Vec<_>>().into_iter().rev())
        .collect();
    let area = 0.5
        * edges(&comb.iter().map(|&v| v.into()).collect::<Vec<DVec2>>())
            .map(|(a, b)| a.perp_dot(b))
            .sum::<f64>();
    covers(&raised(&comb), area, DVec3::Z, 1e-9 * area);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Any star around 0, with its rays in order, is a polygon that does not cross itself.
    #[test]
    fn stars_are_cut_into_their_area(
        radii in prop::collection::vec(0.05_f64..1.0, 4..40),
        first in 0_usize..40,
        tilt in 0.0..PI,
        spin in 0.0..TAU,
    ) {
        let n = radii.len();
        let ray = |k: usize| radii[k] * DVec2::from_angle(TAU * k as f64 / n as f64);
        let mut flat: Vec<DVec2> = (0..n).map(ray).collect();
        flat.rotate_left(first % n);
        let area = 0.5 * edges(&flat).map(|(a, b)| a.perp_dot(b)).sum::<f64>();
        let plane = DMat3::from_rotation_z(spin) * DMat3::from_rotation_x(tilt);
        let polygon: Vec<DVec3> = flat.iter().map(|v| plane * v.extend(0.0)).collect();
        covers(&polygon, area, plane * DVec3::Z, 1e-12);
    }

    /// Whatever the numbers are, there is an answer.
    #[test]
    fn any_vertices_are_cut_or_refused(
        vertices in prop::collection::vec((-3_i8..3, -3_i8..3, -1_i8..1), 3..12),
        power in -140_i32..12,
    ) {
        let scale = 10.0_f64.powi(power);
        let vertex = |&(x, y, z): &(i8, i8, i8)| scale * DVec3::new(x.into(), y.into(), z.into());
        let polygon: Vec<DVec3> = vertices.iter().map(vertex).collect();
        if let Ok(found) = areas(&polygon) {
            prop_assert!(found.len() <= polygon.len() - 2);
            // in a plane the triangles cover what the outline encloses
            if vertices.iter().all(|v| v.2 == 0) {
                let flat: Vec<DVec2> = vertices.iter().map(|v| dvec2(v.0.into(), v.1.into())).collect();
                let enclosed = 0.5 * edges(&flat).map(|(a, b)| a.perp_dot(b)).sum::<f64>();
                let sum: DVec3 = found.into_iter().sum();
                prop_assert!((sum.z - scale * scale * enclosed).abs() <= 1e-9 * scale * scale);
            }
        }
    }
}
