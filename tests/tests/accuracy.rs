//! `--accuracy` means what it says: rounds end when the error is what was asked for, and it is what it says.

#![allow(clippy::unwrap_used)]

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3};
use nestrad_common::canopy::Organ;
use nestrad_common::generate::{LeafAngles, Maize, Stand};
use nestrad_common::options::Diameter;
use nestrad_common::scene::Scene;
use nestrad_engine::account::organ_spread;
use nestrad_engine::exchange::{
    ExchangeError, JobCounts, RowSource, Sampling, Take, ThisProcess, Work,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::plan::{Aims, Estimator, Settings};
use nestrad_engine::rounds::{Ended, Solved};
use nestrad_engine::run::Run;
use nestrad_tests::canopies::{par_and_nir, scenery, small_leaves, uniform_sky};
use nestrad_tests::random::Dice;
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{apart_percent, in_rounds, in_rounds_by, plan, solve, try_plan};

fn reach(scene: &Scene, settings: &Settings) -> Solved {
    in_rounds(scene, settings).unwrap()
}

fn asked(accuracy_percent: f64) -> Settings {
    Settings {
        accuracy_percent,
        in_rounds: true,
        ..Settings::default()
    }
}

fn maize(plants_per_row: u32) -> Scenery {
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
    scenery(
        &plant.generate().unwrap(),
        &par_and_nir(),
        uniform_sky(46, 2),
    )
}

#[test]
fn the_error_that_is_asked_for_is_reached_and_true() {
    let scene = maize(2).scene();
    let by_rays = Settings {
        estimator: Estimator::Rays,
        accuracy_percent: 0.5,
        seed: 77,
        ..Settings::default()
    };
    let reference = solve(&scene, &by_rays).solution;
    let of_reference = organ_spread(&scene.canopy.plants(), &reference);
    for percent in [2.0, 1.0, 0.5] {
        let mut squares = [[0.0; 2]; 2];
        for seed in 1..=3 {
            let settings = Settings {
                seed,
                ..asked(percent)
            };
            let reached = reach(&scene, &settings);
            assert_eq!(reached.accuracy.ended, Ended::Reached, "{percent}");
            for (band, parts) in reached.accuracy.errors.iter().enumerate() {
                let of_reference = of_reference[band].rms_percent.unwrap();
                let apart = apart_percent(&reached.solution, &reference, band);
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
    let mut scenery = maize(1);
    scenery.organs.clear();
    for (k, triangle) in scenery.triangles.iter_mut().enumerate() {
        triangle.organ = k as u32;
        scenery.organs.push(Organ {
            id: k.to_string(),
            plant: "0".to_owned(),
            ..Organ::default()
        });
    }
    let scene = scenery.scene();
    let once = Settings {
        in_rounds: false,
        ..asked(1.0)
    };
    let accuracy = reach(&scene, &once).accuracy;
    assert_eq!(accuracy.ended, Ended::NotAsked, "{accuracy:?}");
    assert_eq!(accuracy.rounds.len(), 1);
    let reached = reach(&scene, &asked(1.0));
    let accuracy = &reached.accuracy;
    assert_eq!(accuracy.ended, Ended::Reached, "{accuracy:?}");
    assert!(accuracy.rounds.len() > 1, "{accuracy:?}");
    let reached: Vec<_> = accuracy.rounds.iter().map(|r| r.reached_percent).collect();
    assert!(reached.is_sorted_by(|a, b| a > b), "{accuracy:?}");
}

#[test]
fn without_memory_the_best_that_fits_has_to_do() {
    let scene = maize(1).scene();
    let settings = Settings {
        budget_s: Some(1e6),
        memory_GiB: 1.05 * plan(&scene, &asked(0.4)).memory.total_GiB(),
        ..asked(0.1)
    };
    let accuracy = reach(&scene, &settings).accuracy;
    assert_eq!(accuracy.ended, Ended::BeyondLimits, "{accuracy:?}");
}

/// Level leaves near the ground, and a tree over them: what a sphere cannot tell from the mean of a level.
fn tree_over_crop() -> Scene {
    let mut dice = Dice(5);
    let mut scenery = Scenery::periodic(DVec2::splat(2.0)).soil(0.0);
    for k in 0..800 {
        let mut around = |middle: f64, width: f64| middle + width * (dice.unit() - 0.5);
        let at = if k < 400 {
            DVec3::new(around(1.0, 2.0), around(1.0, 2.0), around(0.2, 0.3))
        } else {
            DVec3::new(around(1.0, 0.8), around(1.0, 0.8), around(1.5, 0.8))
        };
        scenery.level(&format!("leaf {k}"), at, DVec2::splat(0.1));
    }
    let [par, nir] = par_and_nir();
    scenery.band("PAR", par.1, &[("leaf", par.0)]);
    scenery.band("NIR", nir.1, &[("leaf", nir.0)]);
    scenery.source(from_zenith(30.0, 40.0), 400.0);
    scenery.scene()
}

/// Direct light was 3.06 of 3.11 %, and there was no second round, because the far field alone was too much.
#[test]
fn a_far_field_does_not_keep_a_plan_from_helping_the_rest() {
    let settings = Settings {
        diameter: Diameter::Metres(0.5),
        ..asked(0.5)
    };
    let accuracy = reach(&tree_over_crop(), &settings).accuracy;
    assert_eq!(accuracy.ended, Ended::NoFiner, "{accuracy:?}");
    assert!(accuracy.rounds.len() > 1, "{accuracy:?}");
    for parts in &accuracy.errors {
        let (far, total) = (parts.far_field_percent, parts.total_percent());
        assert!(total < 1.2 * far.max(0.5), "{accuracy:?}");
    }
}

#[test]
fn the_dark_has_no_error() {
    let mut scenery = maize(1);
    scenery.sources.clear();
    let scene = scenery.scene();
    let reached = reach(&scene, &Settings::default());
    assert_eq!(reached.accuracy.ended, Ended::Reached);
    assert!(reached.accuracy.errors.is_empty());
}

/// Where much is asked for, what a scene makes of a plan is measured before most of the work is done.
#[test]
fn a_coarse_look_comes_first_where_it_saves() {
    let leaves = small_leaves(2.0, LeafAngles::Spherical, 0.0025, 4);
    let scene = scenery(&leaves, &par_and_nir(), uniform_sky(46, 2)).scene();
    let reached = reach(&scene, &asked(0.3));
    let accuracy = &reached.accuracy;
    assert_eq!(accuracy.ended, Ended::Reached, "{accuracy:?}");
    let (look, pilot) = (accuracy.rounds[0].planned, Aims::pilot(0.3));
    assert_eq!(look.exchange_percent, pilot.exchange_percent);
    assert_eq!(look.direct_percent, pilot.direct_percent);
    let elements = |aims: &Aims| aims.elements_percent;
    let (own, without) = (elements(&reached.plan.aims), elements(&Aims::of(0.3)));
    assert!(own > without, "{own} {without}");
    // where what is planned does not fit, the look is followed by as much as does
    let little = Settings {
        memory_GiB: 0.8 * plan(&scene, &asked(0.3)).memory.total_GiB(),
        ..asked(0.3)
    };
    assert!(try_plan(&scene, &little).is_err());
    let reached = reach(&scene, &little);
    let accuracy = &reached.accuracy;
    let first = accuracy.rounds[0].reached_percent.unwrap();
    let last = accuracy.rounds.last().unwrap().reached_percent.unwrap();
    assert!(last < 0.5 * first, "{accuracy:?}");
    assert!(reached.plan.memory.total_GiB() <= little.memory_GiB);
}

/// They were cut four times finer than they are now, and had as few directions as maize: two rounds, of which the
/// first was two fifths of the work.
#[test]
fn small_leaves_need_no_second_round() {
    for leaf_m2 in [0.0025, 0.0004] {
        let leaves = small_leaves(2.0, LeafAngles::Spherical, leaf_m2, 4);
        let scene = scenery(&leaves, &par_and_nir(), uniform_sky(46, 2)).scene();
        let accuracy = reach(&scene, &asked(1.0)).accuracy;
        assert_eq!(accuracy.ended, Ended::Reached, "{accuracy:?}");
        assert_eq!(accuracy.rounds.len(), 1, "{accuracy:?}");
        // nor is more done than is needed
        let reached = accuracy.rounds[0].reached_percent.unwrap();
        assert!(reached > 0.5, "{reached}");
    }
}

/// What traces the first round as it should, and fails in the second.
struct FailsLater {
    rounds: AtomicUsize,
    panics: bool,
}

impl RowSource for FailsLater {
    fn cut(&self, frame: &Frame, sampling: &Sampling, run: &Run) -> Result<Work, ExchangeError> {
        ThisProcess::default().cut(frame, sampling, run)
    }

    fn trace(
        &self,
        frame: &Frame,
        work: &Work,
        wanted: &[usize],
        take: &mut Take<'_>,
        run: &Run,
    ) -> Result<JobCounts, ExchangeError> {
        match self.rounds.fetch_add(1, Ordering::Relaxed) {
            0 => ThisProcess::default().trace(frame, work, wanted, take, run),
            _ if self.panics => panic!("out of paper"),
            _ => Err(ExchangeError::Failed("out of paper".to_owned())),
        }
    }
}

#[test]
fn a_later_round_that_fails_leaves_the_round_before_and_names_the_fault() {
    let scene = maize(2).scene();
    // with this, a coarse look comes first
    let settings = asked(0.3);
    for panics in [false, true] {
        let rows = FailsLater {
            rounds: AtomicUsize::new(0),
            panics,
        };
        let kept = in_rounds_by(&scene, &settings, &rows).unwrap();
        assert_eq!(kept.accuracy.ended, Ended::Failed);
        assert_eq!(kept.accuracy.rounds.len(), 1);
        let failure = kept.accuracy.failure.as_deref();
        assert!(failure.unwrap().ends_with("out of paper"), "{failure:?}");
        let said = kept.accuracy.to_string();
        assert!(
            said.contains("missed") && said.contains("a finer round failed"),
            "{said}"
        );
    }
}
