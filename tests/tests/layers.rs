//! Random canopies of small flat leaves: the limits of radiative transfer theory.

#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stderr, reason = "the figures are worth reading")]

use nestrad_common::generate::LeafAngles;
use nestrad_common::optics::LeafOptics;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Estimator;
use nestrad_tests::canopies::{scenery, small_leaves, uniform_sky};
use nestrad_tests::scenery::from_zenith;
use nestrad_tests::solving::{Shares, by, finish, plan, sampling, shares};
use nestrad_tests::statistics::assert_within;

/// Leaves of 2 cm in layers where light travels a metre between leaves: leaves that see the light see
/// each other a little better than chance has it, of the order of their ratio squared, and a canopy of
/// 7500 leaves is one of many.
const SMALL: f64 = 0.003;

fn solved(scene: &Scene, estimator: Estimator) -> Vec<Shares> {
    let mut plan = plan(scene, &by(estimator));
    if let Some(planned) = &mut plan.trace.sampling {
        *planned = sampling(estimator, 0.01, 48.0);
    }
    // leaves of 2 cm are not to be cut: there are thousands
    (plan.trace.max_edge_m, plan.light.direct_line_area_m2) = (0.03, 0.006 * 0.006);
    let solution = finish(scene, &plan).unwrap().solution;
    (0..scene.optics.len())
        .map(|b| shares(&solution, b))
        .collect()
}

/// Kubelka-Munk for horizontal leaves: exact in the limit, whatever the direction of the light.
/// Returns reflected, incident on the soil and absorbed by leaves.
fn horizontal_leaves(rho: f64, tau: f64, soil: f64, lai: f64) -> [f64; 3] {
    let k = ((1.0 - tau).powi(2) - rho * rho).sqrt();
    let r = (1.0 - tau - k) / rho;
    let eta = (soil - r) / (1.0 - soil * r);
    let (whole, half) = ((-2.0 * k * lai).exp(), (-k * lai).exp());
    let denominator = 1.0 + eta * r * whole;
    let reflected = (r + eta * whole) / denominator;
    let reached = (1.0 + eta * r) * half / denominator;
    [reflected, reached, 1.0 - reflected - (1.0 - soil) * reached]
}

#[test]
fn horizontal_leaves_follow_kubelka_and_munk() {
    let [r, t, a] = horizontal_leaves(0.3912, 0.4146, 0.2142, 3.0);
    for (found, known) in [(r, 0.371_617), (t, 0.252_977), (a, 0.429_594)] {
        assert_within("closed form", found, known, 1e-6);
    }
    let leaf = LeafOptics::symmetric(0.3912, 0.4146);
    let canopy = small_leaves(3.0, LeafAngles::Horizontal, 4e-4, 5);
    let scene = scenery(&canopy, &[(leaf, 0.2142)], uniform_sky(12, 1)).scene();
    for estimator in [Estimator::Lines, Estimator::Rays] {
        let found = solved(&scene, estimator)[0];
        eprintln!("{estimator:?}: {found:.5?}, expected {r:.5} {t:.5} {a:.5}");
        assert_within("reflected", found.up, r, SMALL);
        assert_within("reached", found.soil / (1.0 - 0.2142), t, SMALL);
        assert_within("absorbed", found.plants, a, SMALL);
        assert_within("closure", found.closure, 0.0, 0.002);
    }
}

/// Nothing is absorbed but by the soil: R = (s + (1-s) rho L) / (1 + (1-s) rho L).
#[test]
fn conservative_horizontal_leaves_send_back_what_the_soil_does_not_take() {
    let canopy = small_leaves(3.0, LeafAngles::Horizontal, 4e-4, 6);
    let white = LeafOptics::symmetric(0.5, 0.5);
    let soils = [0.0, 0.4];
    let scene = scenery(&canopy, &soils.map(|s| (white, s)), uniform_sky(12, 2)).scene();
    let found = solved(&scene, Estimator::Lines);
    for (s, found) in soils.into_iter().zip(found) {
        let thick = (1.0 - s) * 0.5 * 3.0;
        let expected = (s + thick) / (1.0 + thick);
        eprintln!("{found:.5?}, expected {expected:.5}");
        assert_within("reflected", found.up, expected, SMALL);
        assert_within("absorbed by white leaves", found.plants, 0.0, 1e-9);
        assert_within("closure", found.closure, 0.0, 0.002);
    }
}

/// Leaves that take nothing over soil that takes nothing: all light comes back.
#[test]
fn where_nothing_absorbs_all_light_comes_back() {
    for (rho, tau) in [(0.5, 0.5), (0.1, 0.9), (1.0, 0.0)] {
        let canopy = small_leaves(1.0, LeafAngles::Spherical, 4e-3, 7);
        let white = LeafOptics::symmetric(rho, tau);
        let scene = scenery(&canopy, &[(white, 1.0)], uniform_sky(6, 1)).scene();
        let found = solved(&scene, Estimator::Lines)[0];
        assert_within(
            &format!("albedo of rho {rho} tau {tau}"),
            found.up,
            1.0,
            0.003,
        );
    }
}

/// Black leaves of spherical angles: the part of a beam that meets none is exp(-L / (2 cos theta))
/// (Ross 1981: the mean projection of a leaf is 1/2 for any direction).
#[test]
fn black_spherical_leaves_let_a_beam_through_exponentially() {
    let black = LeafOptics::default();
    for lai in [1.0, 2.0, 3.0] {
        let canopy = small_leaves(lai, LeafAngles::Spherical, 1e-4, 8);
        for zenith in [0.0, 40.0, 60.0] {
            // a beam sees one canopy; from several sides it sees it several times
            let mut scenery = scenery(&canopy, &[(black, 0.0)], Vec::new());
            for side in 0..6 {
                scenery.source(from_zenith(zenith, 60.0 * f64::from(side) + 10.0), 1.0);
            }
            let found = solved(&scenery.scene(), Estimator::Lines)[0];
            let gap = (-lai / (2.0 * zenith.to_radians().cos())).exp();
            eprintln!(
                "LAI {lai} zenith {zenith}: {:.5}, expected {gap:.5}",
                found.soil
            );
            assert_within("gap", found.soil, gap, SMALL);
            assert_within("closure", found.closure, 0.0, 1e-9);
        }
    }
}

/// DESIGN, section 7: 1 - 2 E3(L/2) of a uniform sky is intercepted.
#[test]
fn black_spherical_leaves_intercept_a_uniform_sky() {
    for (lai, expected) in [(1.0, 0.556_791), (2.0, 0.780_616), (3.0, 0.886_521)] {
        let canopy = small_leaves(lai, LeafAngles::Spherical, 1e-4, 9);
        let black = (LeafOptics::default(), 0.0);
        let scene = scenery(&canopy, &[black], uniform_sky(64, 1)).scene();
        let found = solved(&scene, Estimator::Lines)[0];
        eprintln!("LAI {lai}: {:.5}, expected {expected:.5}", found.plants);
        assert_within("intercepted", found.plants, expected, SMALL);
    }
}
