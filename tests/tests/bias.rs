//! Errors that sampling does not show are as large as they are said to be.

#![allow(clippy::unwrap_used)]

use std::num::NonZeroUsize;

use nestrad_common::light::{Sky, SkyLight};
use nestrad_common::options::Diameter;
use nestrad_common::problem::Problem;
use nestrad_master::errors::ErrorParts;
use nestrad_master::plan::{Aims, Plan, Settings};
use nestrad_master::run::Finished;
use nestrad_tests::canopies::{par_and_nir, problem, small_maize, uniform_sky};
use nestrad_tests::solving::{apart_percent, finish, solve};

const BANDS: [usize; 2] = [0, 1];

fn maize() -> Problem {
    problem(&small_maize(), &par_and_nir(), uniform_sky(46, 2))
}

/// Whether what is stated is right to a factor of two.
fn check(what: &str, stated: f64, true_percent: f64) {
    let ratio = stated / true_percent;
    assert!(
        (0.5..2.0).contains(&ratio),
        "{what}: stated {stated}, true {true_percent}"
    );
}

fn parts(finished: &Finished, band: usize) -> &ErrorParts {
    &finished.errors[band]
}

#[test]
fn elements_err_by_what_larger_ones_would_do() {
    let problem = maize();
    // small elements have rays of their own, so sampling has to be finer than what is looked for
    let with = |elements_percent: f64| {
        let aims = Aims {
            elements_percent,
            ..Aims::of(0.15)
        };
        let plan = Plan::aimed(&problem, &Settings::default(), &aims).unwrap();
        finish(&problem, &plan).unwrap()
    };
    let (coarse, fine) = (with(1.5), with(0.2));
    for band in BANDS {
        let apart = apart_percent(&coarse.solution, &fine.solution, band);
        let of = |finished| parts(finished, band).elements_percent;
        assert!(of(&fine) < 0.5 * of(&coarse), "band {band}");
        check(&format!("elements, band {band}"), of(&coarse), apart);
    }
}

#[test]
fn directions_of_a_sky_err_by_what_half_of_them_would_do() {
    let sky = SkyLight {
        sky: Sky::StandardOvercast,
        irradiance_W_m2: vec![100.0; 2],
    };
    let mut problem = maize();
    let mut with = |directions: usize, seed: u64| {
        let directions = NonZeroUsize::new(directions).unwrap();
        problem.light_by(&sky, directions, seed).unwrap();
        solve(&problem, &Settings::default())
    };
    let all = with(1500, 9);
    let few = [1, 2, 3, 4].map(|seed| with(60, seed));
    // what scatters in NIR errs less by its directions than by its lines
    let squares = |of: &dyn Fn(&Finished) -> f64| {
        (few.iter().map(|f| of(f).powi(2)).sum::<f64>() / 4.0).sqrt()
    };
    let apart = squares(&|f| apart_percent(&f.solution, &all.solution, 0));
    let stated = squares(&|f| parts(f, 0).sky_percent);
    check("sky", stated, apart);
    assert!(parts(&all, 0).sky_percent < 0.3 * stated);
}

#[test]
fn sources_of_a_file_are_meant_as_they_are() {
    let finished = solve(&maize(), &Settings::default());
    assert!(finished.errors.iter().all(|parts| parts.sky_percent == 0.0));
    assert!(
        finished
            .errors
            .iter()
            .all(|parts| parts.far_field_percent == 0.0)
    );
}

#[test]
fn a_mean_field_errs_by_what_true_geometry_would_do() {
    let problem = maize();
    let within = |diameter| {
        let settings = Settings {
            diameter,
            ..Settings::default()
        };
        solve(&problem, &settings)
    };
    let (near, full) = (within(Diameter::Metres(0.4)), within(Diameter::Infinite));
    let band = 1;
    let apart = apart_percent(&near.solution, &full.solution, band);
    check("far field", parts(&near, band).far_field_percent, apart);
}
