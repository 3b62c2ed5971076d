//! Errors that sampling does not show are as large as they are said to be.

#![allow(clippy::unwrap_used)]

use std::num::NonZeroUsize;

use nestrad_common::light::Sky;
use nestrad_common::options::Diameter;
use nestrad_common::scene::Scene;
use nestrad_engine::exchange::ThisProcess;
use nestrad_engine::plan::{Aims, Plan, Settings};
use nestrad_engine::solution::BandAccount;
use nestrad_tests::canopies::{par_and_nir, scenery, sky, small_maize, uniform_sky};
use nestrad_tests::scenery::Scenery;
use nestrad_tests::solving::{Solved, aimed, apart_percent, finish, finish_lit, lit, solve};

const BANDS: [usize; 2] = [0, 1];

fn maize() -> Scene {
    scenery(&small_maize(), &par_and_nir(), uniform_sky(46, 2)).scene()
}

/// Whether what is stated is right to a factor of two.
fn check(what: &str, stated: f64, true_percent: f64) {
    let ratio = stated / true_percent;
    assert!(
        (0.5..2.0).contains(&ratio),
        "{what}: stated {stated}, true {true_percent}"
    );
}

fn parts(solved: &Solved, band: usize) -> &BandAccount {
    &solved.solution.account[band]
}

#[test]
fn elements_err_by_what_larger_ones_would_do() {
    let scene = maize();
    // small elements have rays of their own, so sampling has to be finer than what is looked for
    let with = |elements_percent: f64| {
        let aims = Aims {
            elements_percent,
            ..Aims::of(0.15)
        };
        let plan = aimed(&scene, &Settings::default(), &aims);
        finish(&scene, &plan).unwrap()
    };
    let (coarse, fine) = (with(1.5), with(0.2));
    for band in BANDS {
        let apart = apart_percent(&coarse.solution, &fine.solution, band);
        let of = |solved| parts(solved, band).elements_percent;
        assert!(of(&fine) < 0.5 * of(&coarse), "band {band}");
        check(&format!("elements, band {band}"), of(&coarse), apart);
    }
}

#[test]
fn directions_of_a_sky_err_by_what_half_of_them_would_do() {
    let scene = Scenery {
        sky: Some(sky(&Sky::StandardOvercast, 2)),
        ..scenery(&small_maize(), &par_and_nir(), Vec::new())
    }
    .scene();
    let with = |directions: usize, seed: u64| {
        let directions = NonZeroUsize::new(directions).unwrap();
        let sources = scene.light.sources(directions, seed);
        let lit = lit(&scene, &sources);
        let plan = Plan::new(&lit, &Settings::default()).unwrap();
        finish_lit(&lit, &plan, &ThisProcess::default()).unwrap()
    };
    let all = with(1500, 9);
    let few = [1, 2, 3, 4].map(|seed| with(60, seed));
    // what scatters in NIR errs less by its directions than by its lines
    let squares =
        |of: &dyn Fn(&Solved) -> f64| (few.iter().map(|f| of(f).powi(2)).sum::<f64>() / 4.0).sqrt();
    let apart = squares(&|f| apart_percent(&f.solution, &all.solution, 0));
    let stated = squares(&|f| parts(f, 0).sky_percent);
    check("sky", stated, apart);
    assert!(parts(&all, 0).sky_percent < 0.3 * stated);
}

#[test]
fn sources_of_a_file_are_meant_as_they_are() {
    let account = solve(&maize(), &Settings::default()).solution.account;
    assert!(account.iter().all(|parts| parts.sky_percent == 0.0));
    assert!(account.iter().all(|parts| parts.far_field_percent == 0.0));
}

#[test]
fn a_mean_field_errs_by_what_true_geometry_would_do() {
    let scene = maize();
    let within = |diameter| {
        let settings = Settings {
            diameter,
            ..Settings::default()
        };
        solve(&scene, &settings)
    };
    let (near, full) = (within(Diameter::Metres(0.4)), within(Diameter::Infinite));
    let band = 1;
    let apart = apart_percent(&near.solution, &full.solution, band);
    check("far field", parts(&near, band).far_field_percent, apart);
}
