//! `--memory` and `--budget`: the best that fits is done, and more asked never gives less.

#![allow(clippy::unwrap_used, non_snake_case)]

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use glam::{DVec2, DVec3};
use nestrad_common::generate::{LeafAngles, Maize, Stand};
use nestrad_common::optics::LeafOptics;
use nestrad_common::options::Diameter;
use nestrad_common::scene::Scene;
use nestrad_engine::exchange::{
    ExchangeError, JobCounts, RowSource, Sampling, Take, ThisProcess, Work,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::plan::{Aims, Plan, PlanError, Settings};
use nestrad_engine::rounds::{Ended, RoundsError};
use nestrad_engine::run::Run;
use nestrad_tests::canopies::{par_and_nir, scenery, small_leaves, uniform_sky};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::said;
use nestrad_tests::scenery::Scenery;
use nestrad_tests::solving::{in_rounds, in_rounds_by, lit, plan, sources};

fn maize(plants_per_row: u32) -> Scene {
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
    let light = uniform_sky(46, 2);
    scenery(&plant.generate().unwrap(), &par_and_nir(), light).scene()
}

fn leaves() -> Scene {
    let leaves = small_leaves(2.0, LeafAngles::Spherical, 0.0025, 4);
    scenery(&leaves, &par_and_nir(), uniform_sky(46, 2)).scene()
}

fn asked(accuracy_percent: f64, memory_GiB: f64) -> Settings {
    Settings {
        accuracy_percent,
        memory_GiB,
        in_rounds: true,
        ..Settings::default()
    }
}

/// What is planned within the limits.
fn fitting(scene: &Scene, settings: &Settings) -> Result<Plan, PlanError> {
    let aims = Aims::of(settings.accuracy_percent);
    Plan::fitting(&lit(scene, &sources(scene, &aims, settings.seed)), settings)
}

/// What a plan should err by, roughly.
fn planned_percent(plan: &Plan) -> f64 {
    let Aims {
        exchange_percent,
        direct_percent,
        sky_percent,
        elements_percent,
        soil_percent,
        ..
    } = plan.aims;
    let parts = [
        exchange_percent,
        direct_percent,
        sky_percent,
        elements_percent,
        soil_percent,
    ];
    parts.iter().map(|p| p * p).sum::<f64>().sqrt()
}

/// With 2 GiB bean reached 0.53 %, and with `--accuracy 0.4` besides only 1.12 %.
#[test]
fn a_stricter_wish_never_gives_a_coarser_plan() {
    let sphere = Settings {
        diameter: Diameter::Metres(0.4),
        ..Settings::default()
    };
    let cases = [
        (maize(1), Settings::default()),
        (maize(2), sphere),
        (leaves(), Settings::default()),
    ];
    for (scene, settings) in cases {
        let enough_GiB = plan(&scene, &settings).memory.total_GiB();
        for part in [0.5, 0.8, 1.05] {
            let limit_GiB = part * enough_GiB;
            let mut last = f64::INFINITY;
            for (accuracy, in_rounds) in [
                (2.0, true),
                (0.5, false),
                (0.5, true),
                (0.4, true),
                (0.1, true),
            ] {
                let settings = Settings {
                    in_rounds,
                    diameter: settings.diameter,
                    ..asked(accuracy, limit_GiB)
                };
                let planned = match fitting(&scene, &settings) {
                    Ok(plan) => plan,
                    // what is too small is too small for all
                    Err(PlanError::Memory { .. }) => {
                        assert!(last.is_infinite(), "{part} {accuracy}");
                        continue;
                    }
                    Err(error) => panic!("{error}"),
                };
                assert!(planned.memory.total_GiB() <= limit_GiB);
                let percent = planned_percent(&planned);
                assert!(
                    percent < 1.001 * last,
                    "{part} {accuracy}: {percent} {last}"
                );
                last = percent.min(last);
            }
        }
    }
}

/// It was refused, where a little coarser would do.
#[test]
fn a_little_too_little_memory_makes_a_plan_a_little_coarser() {
    let scene = maize(2);
    let whole = plan(&scene, &Settings::default());
    let limit_GiB = 0.95 * whole.memory.total_GiB();
    let settings = Settings {
        memory_GiB: limit_GiB,
        ..Settings::default()
    };
    let less = fitting(&scene, &settings).unwrap();
    assert!(less.is_limited() && !whole.is_limited());
    assert!(less.memory.total_GiB() <= limit_GiB);
    assert!(planned_percent(&less) < 1.5 * planned_percent(&whole));
    let said = less.reasons.join("\n");
    assert!(said.contains("coarser than was asked for"), "{said}");
    // and nothing at all is refused with what is needed
    let settings = Settings {
        memory_GiB: 0.01,
        ..Settings::default()
    };
    let error = fitting(&scene, &settings).unwrap_err();
    assert!(matches!(error, PlanError::Memory { needed, .. } if needed.total_GiB() < 0.1));
}

/// The same with real solves.
#[test]
fn a_stricter_wish_reaches_no_larger_error_under_a_limit() {
    let scene = maize(1);
    let limit_GiB = plan(&scene, &asked(1.0, 8.0)).memory.total_GiB();
    let mut last = f64::INFINITY;
    for accuracy in [1.0, 0.5, 0.1] {
        let solved = in_rounds(&scene, &asked(accuracy, limit_GiB)).unwrap();
        let rounds = &solved.accuracy.rounds;
        let reached = solved.accuracy.errors.iter();
        let reached = reached.map(|band| band.total_percent()).fold(0.0, f64::max);
        assert!(
            reached < 1.02 * last,
            "{accuracy}: {reached} {last} {rounds:?}"
        );
        last = reached.min(last);
        // the best of its rounds is kept
        let of_rounds = rounds.iter().filter_map(|round| round.reached_percent);
        assert_eq!(reached, of_rounds.fold(f64::INFINITY, f64::min));
    }
}

/// 0.5 s became 4.3.
#[test]
fn a_budget_that_is_too_short_is_refused_at_once() {
    let scene = maize(1);
    let settings = Settings {
        budget_s: Some(1e-4),
        ..asked(0.1, 8.0)
    };
    let begun = Instant::now();
    let error = in_rounds(&scene, &settings).unwrap_err();
    assert!(begun.elapsed().as_secs_f64() < 2.0);
    assert!(
        matches!(error, RoundsError::Plan(PlanError::Time { .. })),
        "{error}"
    );
    assert!(error.to_string().contains("allow more with --budget"));
}

/// Rows of this process, but for a second round, which never ends by itself.
struct FirstRoundOnly(AtomicUsize);

impl RowSource for FirstRoundOnly {
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
        if self.0.fetch_add(1, Ordering::Relaxed) > 0 {
            let begun = Instant::now();
            while begun.elapsed().as_secs() < 60 {
                run.stop.check()?;
                std::thread::yield_now();
            }
        }
        ThisProcess::default().trace(frame, work, wanted, take, run)
    }
}

/// 10 s became 14.2.
#[test]
fn a_round_that_is_late_is_stopped_and_the_one_before_it_is_the_result() {
    // done in no time, and not as well as was asked for
    let mut scenery = Scenery::open().soil(0.0);
    scenery.level("leaf", DVec3::new(0.0, 0.0, 0.1), DVec2::splat(0.1));
    scenery.band("NIR", 0.5, &[("leaf", LeafOptics::symmetric(0.4, 0.4))]);
    scenery.source(DVec3::new(0.0, 1.0, -1.0).normalize(), 100.0);
    let settings = Settings {
        budget_s: Some(3.0),
        ..asked(0.05, 8.0)
    };
    let rows = FirstRoundOnly(AtomicUsize::new(0));
    let solved = in_rounds_by(&scenery.scene(), &settings, &rows).unwrap();
    let accuracy = solved.accuracy;
    assert_eq!(accuracy.ended, Ended::OutOfTime, "{accuracy:?}");
    assert_eq!(accuracy.rounds.len(), 1);
    let text = accuracy.to_string();
    assert!(
        text.contains("--budget leaves no time for a finer round"),
        "{text}"
    );
}

/// What the whole process takes, whatever is read, kept or freed on the way.
fn peak_MiB(desk: &Desk, limit_GiB: &str, more: &[&str]) -> f64 {
    let args = [
        "solve",
        "maize/scene.toml",
        "--out",
        "out",
        "--memory",
        limit_GiB,
    ];
    let output = desk.done(&[&args[..], more].concat());
    let said = said(&output);
    let summary = std::fs::read_to_string(desk.path("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let bytes = summary["resources"]["peak_memory_bytes"].as_f64();
    bytes.unwrap_or_else(|| panic!("{said}")) / f64::from(1 << 20)
}

/// A quick part of `tests/memory`: maize within a sphere took 0.24 GiB of 0.17.
#[test]
#[cfg(target_os = "linux")]
fn a_solve_keeps_to_its_memory() {
    let desk = Desk::new();
    desk.maize("maize", "1");
    for (limit_GiB, more) in [
        ("0.07", &[][..]),
        ("0.12", &["--diameter", "0.3"]),
        ("0.12", &["--accuracy", "0.4"]),
    ] {
        let peak = peak_MiB(&desk, limit_GiB, more);
        let limit: f64 = limit_GiB.parse::<f64>().unwrap() * 1024.0;
        assert!(peak <= limit + 32.0, "{limit} {peak} {more:?}");
    }
}
