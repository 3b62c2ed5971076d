//! Form factors with closed forms (DESIGN, section 7), counted from the rows of the real kernel.

#![allow(clippy::print_stderr, reason = "the figures are worth reading")]

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use nestrad_engine::plan::Estimator;
use nestrad_kernel::ends::Side::{Lower, Upper};
use nestrad_tests::enclosure::sphere;
use nestrad_tests::form_factor::Traced;
use nestrad_tests::scenery::Scenery;
use nestrad_tests::solving::{ESTIMATORS, sampling};
use nestrad_tests::statistics::{assert_close, assert_within};

/// Lines: 8 sets in each of 16 batches are 2048 directions, for it is their number that the error of
/// one pair of surfaces follows. Rays: about 400,000 a surface. Both give form factors to 0.002.
fn trace(scenery: &Scenery, edge_m: f64, estimator: Estimator) -> Traced {
    let elements = scenery.elements(edge_m) as f64 / 2.0;
    let mut sampling = sampling(estimator, 0.04, 200_000.0 / elements);
    sampling.sets_per_batch *= 8;
    Traced::new(&scenery.canopy(), edge_m, &sampling)
}

/// Elements of a surface of about a metre: several per triangle, so that pieces take part.
const EDGE_M: f64 = 0.3;

/// Checks F from the upper side of organ 0 to the lower side of organ 1, and back.
fn check_both_ways(what: &str, scenery: &Scenery, expected: [f64; 2]) {
    for estimator in ESTIMATORS {
        let traced = trace(scenery, EDGE_M, estimator);
        let there = traced.form_factor((0, Upper), (1, Lower));
        let back = traced.form_factor((1, Lower), (0, Upper));
        for (way, f, expected) in [("there", there, expected[0]), ("back", back, expected[1])] {
            let what = format!("{what}, {estimator:?}, {way}");
            eprintln!("{what}: {:.5} ± {:.5}, {expected:.5}", f.value, f.se);
            assert_close(&what, f.value, expected, f.se, 4.0, 2e-3);
        }
        let behind = traced.form_factor((0, Lower), (1, Lower));
        assert_eq!(behind.value, 0.0, "{what}: the far side sees through");
    }
}

/// Howell's catalogue of configuration factors, C-11.
#[test]
fn parallel_unit_squares() {
    let mut scenery = Scenery::open();
    scenery.level("square 1", DVec3::ZERO, DVec2::ONE);
    scenery.level("square 2", DVec3::Z, DVec2::ONE);
    check_both_ways("parallel squares", &scenery, [0.199_824_9; 2]);
}

/// Howell's catalogue, C-14.
#[test]
fn perpendicular_unit_squares_with_a_common_edge() {
    let mut scenery = Scenery::open();
    scenery.level("square 1", DVec3::ZERO, DVec2::ONE);
    // its lower face looks at the first square
    scenery.quad(
        "square 2",
        [DVec3::ZERO, DVec3::Z, DVec3::Z + DVec3::Y, DVec3::Y],
    );
    check_both_ways("perpendicular squares", &scenery, [0.200_043_8; 2]);
}

/// Howell's catalogue, C-11.
#[test]
fn parallel_rectangles() {
    let mut scenery = Scenery::open();
    let size = DVec2::new(1.0, 2.0);
    scenery.level("rectangle 1", DVec3::ZERO, size);
    scenery.level("rectangle 2", DVec3::Z * 0.5, size);
    check_both_ways("parallel rectangles", &scenery, [0.508_988_7; 2]);
}

/// Howell's catalogue, C-41. A regular polygon of 128 sides has 0.04 % less area than its circle; one
/// of the same area as the circle has the same form factor to 1e-5.
#[test]
fn parallel_unit_discs() {
    const SIDES: u32 = 128;
    let step = TAU / f64::from(SIDES);
    let radius = (PI / (0.5 * f64::from(SIDES) * step.sin())).sqrt();
    let mut scenery = Scenery::open();
    for (organ, z) in [("disc 1", 0.0), ("disc 2", 1.0)] {
        let rim = |k: u32| {
            let angle = step * f64::from(k);
            DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
        };
        for k in 0..SIDES {
            scenery.triangle(organ, [DVec3::Z * z, rim(k), rim(k + 1)]);
        }
    }
    check_both_ways("parallel discs", &scenery, [0.381_966_0; 2]);
}

/// Rectangles of different size: the way back follows from reciprocity. A square of side 1 above the
/// middle of one of side 2, at distance 1, sees 4 corner configurations of C-13; the value is from an
/// adaptive integration of the double contour integral.
#[test]
fn form_factors_of_unequal_areas_are_reciprocal() {
    let mut scenery = Scenery::open();
    scenery.level("large", DVec3::ZERO, DVec2::splat(2.0));
    scenery.level("small", DVec3::new(0.5, 0.5, 1.0), DVec2::ONE);
    let down = parallel_rectangles_c13([0.5, 1.5], [0.0, 2.0], 1.0);
    check_both_ways("unequal squares", &scenery, [down / 4.0, down]);
}

/// Howell's catalogue, C-13: from the square `a x a` to the coaxial square `b x b` at distance `z`,
/// as a double sum over corners.
fn parallel_rectangles_c13(a: [f64; 2], b: [f64; 2], z: f64) -> f64 {
    // G for distances u, v along x and y (Ehlert & Smith 1993)
    let g = |u: f64, v: f64| {
        let (su, sv) = (z.hypot(u), z.hypot(v));
        (v * su * (v / su).atan() + u * sv * (u / sv).atan()
            - 0.5 * z * z * ((u * u + v * v + z * z) / (z * z)).ln())
            / TAU
    };
    let mut sum = 0.0;
    for (i, x1) in a.iter().enumerate() {
        for (j, y1) in a.iter().enumerate() {
            for (k, x2) in b.iter().enumerate() {
                for (l, y2) in b.iter().enumerate() {
                    let sign = if (i + j + k + l) % 2 == 0 { 1.0 } else { -1.0 };
                    sum += sign * g(x1 - x2, y1 - y2);
                }
            }
        }
    }
    sum / (a[1] - a[0]).powi(2)
}

#[test]
fn the_sum_over_corners_agrees_with_the_catalogue() {
    let f = parallel_rectangles_c13([0.0, 1.0], [0.0, 1.0], 1.0);
    assert_within("C-13 of equal squares", f, 0.199_824_9, 1e-7);
}

/// Every point of a sphere sees every other one alike: F(i,j) = A(j) / (4 pi R²), whatever i is.
/// A facet, 6° wide, does not see itself: that moves 1 / 2048 of its light elsewhere.
#[test]
fn inside_of_a_sphere_everything_sees_area_alone() {
    let scenery = sphere(4);
    for estimator in ESTIMATORS {
        let traced = trace(&scenery, 1.0, estimator);
        let area = |o: usize| -> f64 {
            let of = |&row: &usize| traced.frame.row_area_m2(row);
            traced.rows(o, Lower).iter().map(of).sum()
        };
        let whole: f64 = (0..8).map(area).sum();
        for from in 0..8 {
            for to in 0..8 {
                let f = traced.form_factor((from, Lower), (to, Lower));
                let what = format!("{estimator:?} octant {from} to {to}");
                assert!(f.se < 1.5e-3, "{what}: {f:?}");
                let of_itself = 5e-4;
                assert_within(&what, f.value, area(to) / whole, 4.0 * f.se + of_itself);
            }
            let rows = traced.rows(from, Lower);
            let out = traced.part_seen(&rows, &[0, 1], |end| end >= traced.frame.ends.sky());
            assert_eq!(out.value, 0.0, "{estimator:?}: a closed sphere leaks");
        }
    }
}
