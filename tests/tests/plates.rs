//! Full horizontal plates over soil: what they send back, take and let through is known exactly.

#![allow(clippy::unwrap_used)]

use glam::DVec2;
use nestrad_common::optics::{FaceOptics, LeafOptics};
use nestrad_tests::enclosure::full_plate;
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{ESTIMATORS, by, finish, plan, shares};
use nestrad_tests::statistics::assert_within;

/// What is left when the solver stops: every row sees one plate and nothing else, so there is no
/// sampling error.
const STOPPED: f64 = 4e-4;

/// Adding of layers (Stokes 1862): from the soil up, `albedo` of what lies below a plate, and per
/// plate the irradiance of both its faces, from the top down, for unit irradiance.
struct Stack {
    albedo: f64,
    upper: Vec<f64>,
    lower: Vec<f64>,
    soil: f64,
}

fn stack(n: usize, leaf: LeafOptics, soil_albedo: f64) -> Stack {
    let (upper, lower) = (leaf.upper, leaf.lower);
    // albedo under plate k, counted from the bottom
    let mut under = vec![soil_albedo];
    for k in 0..n {
        let r = under[k];
        under.push(upper.rho + upper.tau * r * lower.tau / (1.0 - lower.rho * r));
    }
    let mut down = 1.0;
    let (mut e_upper, mut e_lower) = (Vec::new(), Vec::new());
    for k in (0..n).rev() {
        // light between this plate and what is below goes to and fro
        let below = down * upper.tau / (1.0 - lower.rho * under[k]);
        e_upper.push(down);
        e_lower.push(below * under[k]);
        down = below;
    }
    Stack {
        albedo: under[n],
        upper: e_upper,
        lower: e_lower,
        soil: down,
    }
}

/// Plates a decimetre apart, each moved past the edges of the pattern by its own bit.
fn scenery(n: usize, leaf: LeafOptics, soil_albedo: f64) -> Scenery {
    let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
    for k in 0..n {
        let z = 0.1 * (n - k) as f64;
        let offset = DVec2::new(0.07, -0.05) * k as f64;
        full_plate(&mut scenery, &format!("leaf {k}"), z, offset);
    }
    scenery.band("B", soil_albedo, &[("leaf", leaf)]);
    scenery.source(from_zenith(0.0, 0.0), 60.0);
    scenery.source(from_zenith(50.0, 30.0), 40.0);
    scenery
}

fn check(n: usize, leaf: LeafOptics, soil_albedo: f64) -> f64 {
    let scenery = scenery(n, leaf, soil_albedo);
    let expected = stack(n, leaf, soil_albedo);
    let mut albedo = 0.0;
    for estimator in ESTIMATORS {
        let mut plan = plan(&scenery.problem, &by(estimator));
        // elements that are large against the lines are evenly lit: then nothing is left to chance
        (plan.max_edge_m, plan.direct_line_area_m2) = (0.1, 5e-6);
        let solution = finish(&scenery.problem, &plan).unwrap().solution;
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
