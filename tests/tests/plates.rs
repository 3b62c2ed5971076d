//! Full horizontal plates over soil: what they send back, take and let through is known exactly.

#![allow(clippy::unwrap_used)]

use nestrad_common::optics::{FaceOptics, LeafOptics};
use nestrad_tests::adding::{plates, stack};
use nestrad_tests::solving::{ESTIMATORS, by, finish, plan, shares};
use nestrad_tests::statistics::assert_within;

/// What is left when the solver stops: every row sees one plate and nothing else, so there is no
/// sampling error.
const STOPPED: f64 = 4e-4;

fn check(n: usize, leaf: LeafOptics, soil_albedo: f64) -> f64 {
    let scenery = plates(n, 0.1, leaf, soil_albedo);
    let expected = stack(n, leaf, soil_albedo);
    let mut albedo = 0.0;
    for estimator in ESTIMATORS {
        let mut plan = plan(&scenery.scene(), &by(estimator));
        // elements that are large against the lines are evenly lit: then nothing is left to chance
        (plan.trace.max_edge_m, plan.light.direct_line_area_m2) = (0.1, 5e-6);
        let solution = finish(&scenery.scene(), &plan).unwrap().solution;
        let found = shares(&solution, 0);
        let what = |of: &str| format!("{n} plates {leaf:?}, {estimator:?}: {of}");
        assert_within(&what("albedo"), found.up, expected.albedo, STOPPED);
        let soil = (1.0 - soil_albedo) * expected.soil;
        assert_within(&what("soil"), found.soil, soil, STOPPED);
        assert_within(&what("closure"), found.closure, 0.0, STOPPED);
        for k in 0..n {
            let (item, up, low) = (&solution.organs[k], expected.upper[k], expected.lower[k]);
            let bound = 100.0 * STOPPED;
            assert_within(
                &what("upper"),
                item.irradiance_upper_W_m2,
                100.0 * up,
                bound,
            );
            assert_within(
                &what("lower"),
                item.irradiance_lower_W_m2,
                100.0 * low,
                bound,
            );
        }
        albedo = found.up;
    }
    albedo
}

/// DESIGN, section 7.
#[test]
fn plates_send_back_what_the_recursion_says() {
    for (n, albedo) in [
        (1, 0.494_505),
        (2, 0.578_799),
        (3, 0.608_486),
        (10, 0.626_763),
    ] {
        let leaf = LeafOptics::symmetric(0.45, 0.45);
        assert_within("recursion", stack(n, leaf, 0.2).albedo, albedo, 1e-6);
        assert_within("albedo", check(n, leaf, 0.2), albedo, STOPPED);
    }
}

#[test]
fn plates_with_different_faces_follow_the_adding_of_layers() {
    let face = |rho, tau| FaceOptics { rho, tau };
    for (upper, lower) in [
        (face(0.30, 0.55), face(0.60, 0.15)),
        (face(0.05, 0.90), face(0.40, 0.50)),
        (face(0.50, 0.0), face(0.10, 0.70)),
    ] {
        for n in [1, 2, 5] {
            check(n, LeafOptics { upper, lower }, 0.35);
        }
    }
}

/// No reflection, or no transmission: light goes one way, or not at all.
#[test]
fn plates_that_only_transmit_or_only_reflect_follow_the_recursion() {
    for (rho, tau) in [(0.0, 0.9), (0.9, 0.0), (0.0, 0.4)] {
        for n in [2, 10] {
            check(n, LeafOptics::symmetric(rho, tau), 0.2);
        }
    }
}
