//! Places that surfaces share: one upon the other, edge to edge, through each other.

use glam::{DVec2, DVec3};
use nestrad_common::optics::LeafOptics;
use nestrad_engine::plan::Estimator;

use super::{AXIS, SUN, by, lit};
use crate::adding::{plates, stack};
use crate::enclosure::closed_box;
use crate::extremes::judge::{all, changed, near, solved, within_se};
use crate::extremes::{Case, Verdict};
use crate::scenery::{Scenery, from_zenith};
use crate::solving::{ESTIMATORS, shares};

/// `n` leaves in one place, on alternate sides up: the light of all is that of as many plates.
fn in_one_place(n: usize, leaf: LeafOptics, turn: bool, estimator: Estimator) -> Verdict {
    let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
    for k in 0..n {
        let at = |x: f64, y: f64| DVec3::new(0.6 * x, 0.4 * y, 0.3);
        let mut corners = [at(0., 0.), at(1., 0.), at(1., 1.), at(0., 1.)];
        if turn && k % 2 == 1 {
            // the same two triangles, turned over
            corners = [corners[0], corners[3], corners[2], corners[1]];
        }
        scenery.quad(&format!("leaf {k}"), corners);
    }
    let scene = lit(scenery, leaf, 0.2);
    let solution = changed(&scene, &by(estimator), |plan| {
        (plan.trace.max_edge_m, plan.light.tolerance.absorbed) = (0.3, 1e-6);
    })?
    .solution;
    let expected = stack(n, leaf, 0.2);
    let found = shares(&solution, 0);
    all([
        near("albedo", found.up, expected.albedo, 1e-4),
        near("soil", found.soil, 0.8 * expected.soil, 1e-4),
    ])
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for estimator in ESTIMATORS {
        for (name, n, turn) in [
            ("2 times the same leaf", 2, false),
            ("100 times the same leaf", 100, false),
            ("2 leaves back to back", 2, true),
        ] {
            cases.push(Case::new(
                AXIS,
                format!("{name}, {estimator:?}"),
                format!("adding of {n} plates"),
                move || in_one_place(n, LeafOptics::symmetric(0.4, 0.4), turn, estimator),
            ));
        }
        cases.push(Case::new(
            AXIS,
            format!("leaves 0.1 mm apart, 10 m above the soil, {estimator:?}"),
            "adding of 3 plates",
            move || {
                let leaf = LeafOptics::symmetric(0.45, 0.45);
                let scenery = plates(3, 1e-4, leaf, 0.2).soil(-10.0);
                let solution = changed(&scenery.scene(), &by(estimator), |plan| {
                    (plan.trace.max_edge_m, plan.light.direct_line_area_m2) = (0.1, 5e-6);
                })?
                .solution;
                near(
                    "albedo",
                    shares(&solution, 0).up,
                    stack(3, leaf, 0.2).albedo,
                    1e-3,
                )
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("T-junctions: a flat leaf of three triangles that share no edge whole, {estimator:?}"),
            "no face of a flat leaf sees another: the lower ones stay dark",
            move || flat_leaf_with_t_junctions(estimator),
        ));
        cases.push(Case::new(
            AXIS,
            format!("a closed box in the sun, white inside, {estimator:?}"),
            "dark inside",
            move || {
                let mut scenery = Scenery::open();
                closed_box(&mut scenery, DVec3::splat(0.1), DVec3::new(0.3, 0.4, 0.5));
                let white = LeafOptics::opaque(1.0);
                scenery.band("B", 0.0, &[("wall", white)]);
                scenery.source(from_zenith(40.0, 30.0), SUN);
                let solution = solved(&scenery.scene(), &by(estimator))?.solution;
                let inside: Vec<f64> = solution
                    .organs
                    .iter()
                    .map(|o| o.irradiance_upper_W_m2)
                    .collect();
                near(
                    "irradiance",
                    inside.into_iter().fold(0.0, f64::max),
                    0.0,
                    0.0,
                )
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("two leaves through each other, {estimator:?}"),
            "one is the other mirrored: both take the same",
            move || crossing(estimator),
        ));
    }
    cases
}

fn flat_leaf_with_t_junctions(estimator: Estimator) -> Verdict {
    // in a slanted plane
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.3 * x - 0.2 * y);
    let mut scenery = Scenery::open();
    scenery.triangle("leaf 1", [at(0., 0.), at(1., 0.), at(0., 1.)]);
    scenery.triangle("leaf 1", [at(1., 0.), at(1., 1.), at(0.5, 0.5)]);
    scenery.triangle("leaf 1", [at(1., 1.), at(0., 1.), at(0.5, 0.5)]);
    let scene = lit(scenery, LeafOptics::opaque(0.9), 0.0);
    let item = solved(&scene, &by(estimator))?.solution.organs[0];
    all([
        near("lower", item.irradiance_lower_W_m2, 0.0, 0.0),
        within_se("power/W", item.absorbed_W, 0.1 * SUN, item.absorbed_se_W),
    ])
}

/// Two squares that cross in a line along y, mirrored in the plane x = 0, in the sun of the zenith.
fn crossing(estimator: Estimator) -> Verdict {
    let mut scenery = Scenery::open();
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let one = [
        at(-1., 0., -1.),
        at(1., 0., 1.),
        at(1., 2., 1.),
        at(-1., 2., -1.),
    ];
    scenery.quad("leaf 1", one);
    let mirrored = one.map(|v| DVec3::new(-v.x, v.y, v.z));
    scenery.quad(
        "leaf 2",
        [mirrored[1], mirrored[0], mirrored[3], mirrored[2]],
    );
    let scene = lit(scenery, LeafOptics::symmetric(0.4, 0.4), 0.0);
    let organs = solved(&scene, &by(estimator))?.solution.organs;
    let [a, b] = [organs[0], organs[1]];
    let se = a.absorbed_se_W.hypot(b.absorbed_se_W);
    within_se("power/W", a.absorbed_W, b.absorbed_W, se)
}
