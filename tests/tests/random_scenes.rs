//! What must hold of any scene, over ten thousand small ones: of all that has to do with light. A scene is its
//! seed (`random::scenery`). For order, place and limits see `random_scenes_moved.rs`.

#![allow(clippy::unwrap_used)]

use glam::DVec3;
use nestrad_common::optics::LeafOptics;
use nestrad_tests::extremes::judge::sound;
use nestrad_tests::random::{Dice, cheap, scenery};
use nestrad_tests::scenery::Scenery;
use nestrad_tests::solving::{Solved, coarse, finish, plan, try_plan};
use proptest::prelude::*;

/// Of four properties each, with two or more solves.
const CASES: u32 = 2500;

fn solved(scenery: &Scenery) -> Result<Solved, TestCaseError> {
    let fail = |e: String| TestCaseError::fail(e);
    let scene = scenery.scene();
    let mut plan = try_plan(&scene, &coarse()).map_err(|e| fail(e.to_string()))?;
    cheap(&mut plan);
    finish(&scene, &plan).map_err(|e| fail(e.to_string()))
}

/// What rounding and the solver's tolerance (1e-9) may leave.
const ROUNDING: f64 = 1e-6;

proptest! {
    #![proptest_config(ProptestConfig { cases: CASES, failure_persistence: None, ..ProptestConfig::default() })]

    /// 0 <= absorbed <= incoming, and a balance that closes within its error; light of two sources is the
    /// sum of the light of each.
    #[test]
    fn light_is_conserved_and_adds_up(seed: u64) {
        let mut scenery = scenery(seed);
        // three bands alike: both sources, the first, the second
        let band = scenery.bands[0].clone();
        scenery.bands = vec![band; 3];
        let [a, b] = [0, 1].map(|k: usize| scenery.sources[k].irradiance_W_m2[0]);
        scenery.sources[0].irradiance_W_m2 = vec![a, a, 0.0];
        scenery.sources[1].irradiance_W_m2 = vec![b, 0.0, b];
        let solution = solved(&scenery)?.solution;
        sound(&solution, 0.02).map_err(TestCaseError::fail)?;
        let incoming = solution.balance[0].incoming_W;
        for item in solution.organs.chunks_exact(3) {
            let off = (item[0].absorbed_W - item[1].absorbed_W - item[2].absorbed_W).abs();
            prop_assert!(off <= ROUNDING * incoming, "seed {}: {} of {}", seed, off, incoming);
        }
    }

    /// Light times a power of two: all results times it, to the last bit.
    #[test]
    fn light_scales_to_the_bit(seed: u64, power in -20i32..20) {
        let scenery = scenery(seed);
        let factor = 2f64.powi(power);
        let mut brighter = scenery.clone();
        for source in &mut brighter.sources {
            source.irradiance_W_m2.iter_mut().for_each(|i| *i *= factor);
        }
        let (a, b) = (solved(&scenery)?.solution, solved(&brighter)?.solution);
        for (a, b) in a.triangles.iter().zip(&b.triangles) {
            prop_assert_eq!(a.irradiance_upper_W_m2 * factor, b.irradiance_upper_W_m2);
            prop_assert_eq!(a.irradiance_lower_W_m2 * factor, b.irradiance_lower_W_m2);
            prop_assert_eq!(a.absorbed_W * factor, b.absorbed_W);
            prop_assert_eq!(a.absorbed_se_W * factor, b.absorbed_se_W);
        }
        for (a, b) in a.balance.iter().zip(&b.balance) {
            prop_assert_eq!(a.escaped_up_W.value * factor, b.escaped_up_W.value);
            prop_assert_eq!(a.closure_W.value * factor, b.closure_W.value);
        }
    }

    /// The unit of length does not matter: lengths times two are powers times four, to the last bit.
    #[test]
    fn lengths_scale_to_the_bit(seed: u64) {
        let scenery = scenery(seed);
        let mut larger = scenery.clone();
        larger.vertices_m().for_each(|v| *v *= 2.0);
        larger.soil_z_m = scenery.soil_z_m.map(|z| 2.0 * z);
        if let Some(pattern) = &mut larger.pattern {
            pattern.size_m *= 2.0;
        }
        let solved = |scenery: &Scenery, factor: f64| {
            let scene = scenery.scene();
            let mut plan = plan(&scene, &coarse());
            cheap(&mut plan);
            plan.trace.max_edge_m *= factor;
            plan.trace.soil_cell_m *= factor;
            finish(&scene, &plan).unwrap().solution
        };
        let a = solved(&scenery, 1.0);
        let b = solved(&larger, 2.0);
        for (a, b) in a.triangles.iter().zip(&b.triangles) {
            prop_assert_eq!(a.irradiance_upper_W_m2, b.irradiance_upper_W_m2);
            prop_assert_eq!(4.0 * a.absorbed_W, b.absorbed_W);
        }
    }

    /// Something black more takes light from others and gives none, within the errors.
    #[test]
    fn something_black_brightens_nothing(seed: u64) {
        let mut scenery = scenery(seed);
        let mut dice = Dice(!seed);
        let before = solved(&scenery)?.solution;
        let mut corner = || DVec3::new(dice.unit(), dice.unit(), dice.unit());
        // within the box of what there is, so that the lines stay where they are
        let inside = |v: DVec3, scenery: &Scenery| {
            let all = || scenery.corners_m().flatten();
            let (lo, hi) = all().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), v| (lo.min(*v), hi.max(*v)));
            lo + v * (hi - lo)
        };
        let corners = [corner(), corner(), corner()].map(|v| inside(v, &scenery));
        // the last of the organs, so that random numbers of the others stay as they are
        scenery.triangle("something black", corners);
        let materials = scenery.materials.len();
        scenery.bands[0].materials.resize(materials, LeafOptics::default());
        let after = solved(&scenery)?.solution;
        let incoming = before.balance[0].incoming_W;
        for (a, b) in before.organs.iter().zip(&after.organs) {
            let allowed = 1e-4 * incoming;
            prop_assert!(b.absorbed_W <= a.absorbed_W + allowed, "seed {}: {} to {}", seed, a.absorbed_W, b.absorbed_W);
        }
    }
}
