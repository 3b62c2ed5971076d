//! `--accuracy` means what it says: rounds end when the error is what was asked for, and it is what it says.

#![allow(clippy::unwrap_used)]

use nestrad_common::generate::{LeafAngles, Maize, Stand};
use nestrad_common::problem::Problem;
use nestrad_master::errors::organ_errors;
use nestrad_master::output::progress::Progress;
use nestrad_master::output::resources::Stopwatch;
use nestrad_master::plan::{Aims, Estimator, Plan, Settings};
use nestrad_master::rounds::{Ended, Reached, solve_in_rounds};
use nestrad_master::run::Means;
use nestrad_tests::canopies::{par_and_nir, problem, small_leaves, uniform_sky};
use nestrad_tests::solving::{apart_percent, plan, solve};

fn reach(problem: &Problem, settings: &Settings) -> Reached {
    let (means, progress) = (Means::default(), Progress::new(true));
    let watch = &mut Stopwatch::start();
    solve_in_rounds(problem, None, settings, means, &progress, watch, |_, _| ()).unwrap()
}

fn asked(accuracy_percent: f64) -> Settings {
    Settings {
        accuracy_percent,
        in_rounds: true,
        ..Settings::default()
    }
}

fn maize(plants_per_row: u32) -> Problem {
    let plant = Maize {
        stand: Stand {
            rows: 1,
            plants_per_row,
            row_spacing_m: 0.5,
            plant_spacing_m: 0.25,
        },
        leaf_triangle_m2: 1e-3,
        ..Maize::default()
    };
    problem(
        &plant.generate().unwrap(),
        &par_and_nir(),
        uniform_sky(46, 2),
    )
}

#[test]
fn the_error_that_is_asked_for_is_reached_and_true() {
    let problem = maize(2);
    let by_rays = Settings {
        estimator: Estimator::Rays,
        accuracy_percent: 0.5,
        seed: 77,
        ..Settings::default()
    };
    let reference = solve(&problem, &by_rays).solution;
    let of_reference = organ_errors(&problem.scene, &reference);
    for percent in [2.0, 1.0, 0.5] {
        let mut squares = [[0.0; 2]; 2];
        for seed in 1..=3 {
            let settings = Settings {
                seed,
                ..asked(percent)
            };
            let reached = reach(&problem, &settings);
            assert_eq!(reached.accuracy.ended, Ended::Reached, "{percent}");
            for (band, parts) in reached.accuracy.errors.iter().enumerate() {
                let of_reference = of_reference[band].rms_percent.unwrap();
                let apart = apart_percent(&reached.finished.solution, &reference, band);
                let stated = parts.total_percent();
                let own = (apart.powi(2) - of_reference.powi(2)).max(0.0).sqrt();
                assert!(
                    own <= percent && stated <= percent,
                    "{percent}: {own} of {parts:?}"
                );
                squares[band][0] += apart.powi(2);
                squares[band][1] += stated.powi(2) + of_reference.powi(2);
            }
        }
        // what is stated is neither far above the truth nor below it; few organs tell little of a single run
        for [apart, stated] in squares {
            let ratio = (apart / stated).sqrt();
            assert!((0.6..1.5).contains(&ratio), "{percent}: {ratio}");
        }
    }
}

#[test]
fn a_round_that_misses_is_followed_by_a_finer_one() {
    // organs of one small triangle each are met by few lines
    let mut problem = maize(1);
    let scene = &mut problem.scene;
    let organs = scene.triangles.len() as u32;
    scene.organs = (0..organs)
        .map(|k| nestrad_common::scene::Organ {
            id: k.to_string(),
            plant: "0".to_owned(),
        })
        .collect();
    scene.organ = (0..organs).collect();
    let once = Settings {
        in_rounds: false,
        ..asked(1.0)
    };
    let accuracy = reach(&problem, &once).accuracy;
    assert_eq!(accuracy.ended, Ended::NotAsked, "{accuracy:?}");
    assert_eq!(accuracy.rounds.len(), 1);
    let reached = reach(&problem, &asked(1.0));
    let accuracy = &reached.accuracy;
    assert_eq!(accuracy.ended, Ended::Reached, "{accuracy:?}");
    assert!(accuracy.rounds.len() > 1, "{accuracy:?}");
    let reached: Vec<_> = accuracy.rounds.iter().map(|r| r.reached_percent).collect();
    assert!(reached.is_sorted_by(|a, b| a > b), "{accuracy:?}");
}

#[test]
fn without_time_a_pilot_has_to_do_and_says_what_it_reached() {
    let settings = Settings {
        budget_s: Some(1e-6),
        ..asked(0.1)
    };
    let accuracy = reach(&maize(1), &settings).accuracy;
    assert_eq!(accuracy.ended, Ended::OutOfTime);
    assert_eq!(accuracy.rounds.len(), 1);
    assert!(accuracy.rounds[0].reached_percent.unwrap() > 0.1);
    assert!(accuracy.to_string().contains("the time allowed is up"));
}

#[test]
fn without_memory_the_best_that_fits_has_to_do() {
    let problem = maize(1);
    let settings = Settings {
        budget_s: Some(1e6),
        memory_GiB: 1.05 * plan(&problem, &asked(0.4)).memory.total_GiB(),
        ..asked(0.1)
    };
    let accuracy = reach(&problem, &settings).accuracy;
    assert_eq!(accuracy.ended, Ended::BeyondLimits, "{accuracy:?}");
}

#[test]
fn the_dark_has_no_error() {
    let mut problem = maize(1);
    problem.sources.clear();
    let reached = reach(&problem, &Settings::default());
    assert_eq!(reached.accuracy.ended, Ended::Reached);
    assert!(reached.accuracy.errors.is_empty());
}

/// Where much is asked for, what a scene makes of a plan is measured before most of the work is done.
#[test]
fn a_coarse_look_comes_first_where_it_saves() {
    let leaves = small_leaves(2.0, LeafAngles::Spherical, 0.0025, 4);
    let problem = problem(&leaves, &par_and_nir(), uniform_sky(46, 2));
    let reached = reach(&problem, &asked(0.3));
    let accuracy = &reached.accuracy;
    assert_eq!(accuracy.ended, Ended::Reached, "{accuracy:?}");
    let (look, pilot) = (accuracy.rounds[0].planned, Aims::pilot(0.3));
    assert_eq!(look.exchange_percent, pilot.exchange_percent);
    assert_eq!(look.direct_percent, pilot.direct_percent);
    let elements = |aims: &Aims| aims.elements_percent;
    let (own, without) = (elements(&reached.plan.aims), elements(&Aims::of(0.3)));
    assert!(own > without, "{own} {without}");
    // where what is planned does not fit, what the look comes to has to do
    let little = Settings {
        memory_GiB: 0.8 * plan(&problem, &asked(0.3)).memory.total_GiB(),
        ..asked(0.3)
    };
    assert!(Plan::new(&problem, &little).is_err());
    let accuracy = reach(&problem, &little).accuracy;
    assert_eq!(accuracy.ended, Ended::BeyondLimits, "{accuracy:?}");
    assert_eq!(accuracy.rounds.len(), 1, "{accuracy:?}");
}

/// They were cut four times finer than they are now, and had as few directions as maize: two rounds, of which the
/// first was two fifths of the work.
#[test]
fn small_leaves_need_no_second_round() {
    for leaf_m2 in [0.0025, 0.0004] {
        let leaves = small_leaves(2.0, LeafAngles::Spherical, leaf_m2, 4);
        let problem = problem(&leaves, &par_and_nir(), uniform_sky(46, 2));
        let accuracy = reach(&problem, &asked(1.0)).accuracy;
        assert_eq!(accuracy.ended, Ended::Reached, "{accuracy:?}");
        assert_eq!(accuracy.rounds.len(), 1, "{accuracy:?}");
        // nor is more done than is needed
        let reached = accuracy.rounds[0].reached_percent.unwrap();
        assert!(reached > 0.5, "{reached}");
    }
}
