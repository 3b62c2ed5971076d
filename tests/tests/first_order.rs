//! `--scatter none`: direct light alone, and a balance that says what is not followed.

#![allow(clippy::unwrap_used)]

use glam::{DVec2, DVec3};
use nestrad_common::optics::LeafOptics;
use nestrad_common::options::{Diameter, Scatter};
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_engine::solution::Solution;
use nestrad_kernel::rows::Counts;
use nestrad_tests::adding::plates;
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::Master;
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{coarse, in_rounds, plan, solve};
use nestrad_tests::statistics::assert_within;

fn first_order() -> Settings {
    Settings {
        scatter: Scatter::None,
        ..coarse()
    }
}

/// What is missing in a balance, in parts of what comes in.
fn closure(solution: &Solution, band: usize) -> f64 {
    solution.balance[band].closure_W.value / solution.balance[band].incoming_W
}

#[test]
fn the_upper_of_two_plates_keeps_what_it_absorbs_and_the_rest_is_not_followed() {
    let leaf = LeafOptics::symmetric(0.45, 0.35);
    let scene = plates(2, 0.1, leaf, 0.2).scene();
    let solved = solve(&scene, &first_order());
    let (solution, balance) = (&solved.solution, &solved.solution.balance[0]);
    let whole = balance.incoming_W;
    assert_within("upper", solution.organs[0].absorbed_W / whole, 0.2, 1e-9);
    assert_within("lower", solution.organs[1].absorbed_W, 0.0, 0.0);
    assert_within("soil", balance.absorbed_soil_W.value, 0.0, 0.0);
    assert_within("scattered", balance.scattered_W.value / whole, 0.8, 1e-9);
    assert_within("closure", closure(solution, 0), 0.0, 1e-9);
    for item in &solution.organs {
        assert_eq!(item.absorbed_W, item.absorbed_direct_W);
    }
    assert_eq!(solved.work.exchange, Counts::default());
    assert_eq!((solved.work.jobs.traced, solved.work.passes), (0, 0));
}

/// A leaf of 0.2 m over one of 0.4 m: the larger one has three quarters of its light.
#[test]
fn a_leaf_over_another_shades_as_much_as_it_covers() {
    let mut scenery = Scenery::open().soil(-0.1);
    scenery.level("small", DVec3::new(0.1, 0.1, 0.2), DVec2::splat(0.2));
    scenery.level("large", DVec3::ZERO, DVec2::splat(0.4));
    let [small, large] = [LeafOptics::symmetric(0.1, 0.2), LeafOptics::opaque(0.4)];
    scenery.band("B", 0.3, &[("small", small), ("large", large)]);
    scenery.source(DVec3::NEG_Z, 500.0);
    let solution = solve(&scenery.scene(), &first_order()).solution;
    for (id, absorptance, lit_m2) in [("small", 0.7, 0.04), ("large", 0.6, 0.12)] {
        let item = solution.organs[scenery.organ(id)];
        let expected = 500.0 * absorptance * lit_m2;
        let bound = (4.0 * item.absorbed_se_W).max(0.002 * expected);
        assert_within(id, item.absorbed_W, expected, bound);
    }
    let balance = &solution.balance[0];
    let leaves = 500.0 * (0.3 * 0.04 + 0.4 * 0.12);
    let soil = balance.absorbed_soil_W.value / 0.7;
    let scattered = balance.scattered_W;
    let bound = (4.0 * scattered.se).max(0.1);
    assert_within("scattered", scattered.value, leaves + 0.3 * soil, bound);
    assert_within("closure", closure(&solution, 0), 0.0, 1e-9);
}

fn shaded_leaves(pattern: bool) -> Scene {
    let mut scenery = if pattern {
        Scenery::periodic(DVec2::new(1.0, 0.8)).soil(-0.02)
    } else {
        Scenery::open().soil(-0.02)
    };
    for k in 0..6 {
        let x = 0.13 * f64::from(k);
        let at = DVec3::new(x, 0.1 + 0.3 * x, 0.1 + 0.07 * f64::from(k % 4));
        scenery.level(&format!("leaf {k}"), at, DVec2::new(0.3, 0.2));
    }
    scenery.band("PAR", 0.15, &[("leaf", LeafOptics::symmetric(0.1, 0.05))]);
    scenery.band("NIR", 0.25, &[("leaf", LeafOptics::symmetric(0.45, 0.45))]);
    scenery.source(from_zenith(35.0, 20.0), 400.0);
    scenery.source(from_zenith(60.0, 200.0), 80.0);
    scenery.scene()
}

/// The direct light is that of a whole solve, whose exchange changes nothing of it.
#[test]
fn it_is_the_direct_light_of_a_whole_solve_to_the_last_bit() {
    for pattern in [false, true] {
        let scene = shaded_leaves(pattern);
        let whole = solve(&scene, &coarse()).solution;
        let first = solve(&scene, &first_order()).solution;
        for (item, of_whole) in first.organs.iter().zip(&whole.organs) {
            assert_eq!(
                item.absorbed_W.to_bits(),
                of_whole.absorbed_direct_W.to_bits()
            );
            assert_eq!(item.absorbed_direct_W, of_whole.absorbed_direct_W);
            assert!(item.absorbed_se_W <= of_whole.absorbed_se_W);
        }
        for (item, of_whole) in first.triangles.iter().zip(&whole.triangles) {
            assert_eq!(
                item.absorbed_W.to_bits(),
                of_whole.absorbed_direct_W.to_bits()
            );
        }
        for (band, balance) in first.balance.iter().enumerate() {
            assert!(balance.scattered_W.value > 0.0, "{balance:?}");
            assert_eq!(whole.balance[band].scattered_W.value, 0.0);
            let bound = 1e-9 + 5.0 * balance.closure_W.se / balance.incoming_W;
            assert_within("closure", closure(&first, band), 0.0, bound);
        }
        for account in &first.account {
            assert_eq!(
                (account.exchange_percent, account.elements_percent),
                (0.0, 0.0)
            );
            assert_eq!((account.soil_percent, account.solver_percent), (0.0, 0.0));
        }
    }
}

/// A sphere bounds what is exchanged: nothing is.
#[test]
fn a_sphere_makes_no_far_field_and_an_accuracy_is_reached_by_direct_light_alone() {
    let scene = shaded_leaves(true);
    let nested = Settings {
        diameter: Diameter::Metres(0.1),
        ..first_order()
    };
    let planned = plan(&scene, &nested);
    assert!(planned.trace.far_field.is_none() && planned.trace.radius_m.is_none());
    assert!(planned.trace.sampling.is_none() && planned.light.scattering_bands.is_empty());
    let said = planned.reasons.join("\n");
    assert!(said.contains("not followed (--scatter none)"), "{said}");
    assert!(said.contains("exchange: none"), "{said}");
    assert_eq!(
        solve(&scene, &nested).solution,
        solve(&scene, &first_order()).solution
    );

    let asked = Settings {
        accuracy_percent: 0.1,
        in_rounds: true,
        ..first_order()
    };
    let solved = in_rounds(&scene, &asked).unwrap();
    let reached = solved
        .accuracy
        .rounds
        .last()
        .unwrap()
        .reached_percent
        .unwrap();
    assert!(reached <= 0.1, "{:?}", solved.accuracy);
    assert_eq!(solved.work.exchange, Counts::default());
}

#[test]
fn a_black_scene_is_the_same_with_and_without() {
    let scene = plates(1, 0.1, LeafOptics::default(), 0.0).scene();
    assert_eq!(
        solve(&scene, &coarse()).solution,
        solve(&scene, &first_order()).solution
    );
}

#[test]
fn the_command_line_a_scene_file_and_a_master_give_the_same_bytes() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    desk.compare("scene.toml", &["--scatter", "none"], &master);
    let by_flag = desk.tables("here");
    let text = std::fs::read_to_string(desk.path("scene.toml")).unwrap();
    std::fs::write(
        desk.path("first.toml"),
        text + "[options]\nscatter = \"none\"\n",
    )
    .unwrap();
    let solve = ["solve", "first.toml", "--out"];
    desk.done(&[&solve[..], &["file"]].concat());
    assert!(by_flag == desk.tables("file"));
    // workers have nothing to do
    desk.done(&[&solve[..], &["workers", "--workers", "2"]].concat());
    assert!(by_flag == desk.tables("workers"));
    for out in ["here", "there"] {
        let text = std::fs::read_to_string(desk.path(out).join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(summary["options"]["scatter"], "none");
        let scattered = &summary["energy_balance"][1]["scattered_W"]["value"];
        assert!(scattered.as_f64().unwrap() > 100.0, "{out}: {scattered}");
    }
    desk.done(&["solve", "first.toml", "--out", "whole", "--scatter", "all"]);
    assert!(by_flag != desk.tables("whole"));
}

/// A leaf of 0.2 m over one of 0.4 m that stands on its side to half of the sun: of the first all is sunlit, of the
/// second three quarters, whichever side is up; of a folded leaf the half that the sun reaches.
#[test]
fn the_sun_reaches_what_stands_in_nobodys_shade() {
    let mut scenery = Scenery::open();
    scenery.level("small", DVec3::new(0.1, 0.1, 0.2), DVec2::splat(0.2));
    let corners = [[0.0, 0.0], [0.0, 0.4], [0.4, 0.4], [0.4, 0.0]];
    // its lower side is up
    scenery.quad("large", corners.map(|[x, y]| DVec3::new(x, y, 0.0)));
    // a wall that the sun does not see, and one that it sees
    let wall = [[0.0, 0.0], [0.3, 0.0], [0.3, 0.3], [0.0, 0.3]];
    scenery.quad("wall", wall.map(|[x, z]| DVec3::new(2.0 + x, 1.0, z)));
    scenery.quad("slope", wall.map(|[x, z]| DVec3::new(4.0 + x, z, z)));
    scenery.band("B", 0.0, &[]);
    let dark = solve(&scenery.scene(), &first_order()).solution;
    assert!(dark.organ_sunlit_m2.is_empty());
    // a weaker one from the side does not count
    scenery.source(DVec3::new(0.0, 1.0, -1.0), 10.0);
    scenery.source(DVec3::NEG_Z, 500.0);
    let solution = solve(&scenery.scene(), &first_order()).solution;
    for (id, expected) in [
        ("small", 0.04),
        ("large", 0.12),
        ("wall", 0.0),
        ("slope", 0.3 * 0.3 * 2f64.sqrt()),
    ] {
        let organ = scenery.organ(id);
        let sunlit = solution.organ_sunlit_m2[organ];
        let area_m2 = solution.organ_area_m2[organ];
        assert!(sunlit.value <= area_m2 * (1.0 + 1e-12), "{id}: {sunlit:?}");
        assert!(sunlit.se < 0.01 * area_m2, "{id}: {sunlit:?}");
        let bound = (4.0 * sunlit.se).max(1e-9);
        assert_within(id, sunlit.value, expected, bound);
    }
}
