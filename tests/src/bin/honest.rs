//! Whether `--accuracy` is honest, and what it costs: for scenes, targets and seeds the true error of the worst band
//! against what was asked for and what was stated. Writes `master/docs/figures/honest.csv`.
//!
//! True errors are those against rays on finer elements, or against the Monte Carlo solutions beside the sample
//! scenes, whose own errors are taken off.

#![allow(clippy::print_stderr, reason = "a command that says how far it is")]

use std::fmt::Write;
use std::fs;

use nestrad_common::generate::{Generated, LeafAngles, Maize, Stand};
use nestrad_common::light::Sky;
use nestrad_common::scene::Scene;
use nestrad_engine::account::organ_spread;
use nestrad_engine::plan::{Aims, Estimator, Settings};
use nestrad_engine::solution::{BandAccount, Solution};
use nestrad_engine::stopwatch::Stopwatch;
use nestrad_tests::canopies::{par_and_nir, scenery, sky, small_leaves, small_maize};
use nestrad_tests::reference::{misfit, organs, sample, shared};
use nestrad_tests::scenery::Scenery;
use nestrad_tests::solving::{aimed, apart_percent, finish, in_rounds};

type Fault = Box<dyn std::error::Error>;

const TARGETS_PERCENT: [f64; 3] = [2.0, 1.0, 0.5];
const SEEDS: [u64; 5] = [1, 2, 3, 4, 5];

/// How a solution is judged, in percent by band.
type Judge = Box<dyn Fn(&Solution) -> Vec<f64>>;

struct Case {
    name: &'static str,
    scene: Scene,
    judge: Judge,
}

/// A canopy under an overcast sky, judged by rays.
fn by_rays(name: &'static str, generated: &Generated) -> Result<Case, Fault> {
    let scene = Scenery {
        sky: Some(sky(&Sky::StandardOvercast, 2)),
        ..scenery(generated, &par_and_nir(), Vec::new())
    }
    .scene();
    let aims = Aims {
        exchange_percent: 1.2,
        direct_percent: 0.15,
        sky_percent: 0.09,
        elements_percent: 0.2,
        soil_percent: 0.2,
        thin: false,
    };
    let settings = Settings {
        estimator: Estimator::Rays,
        seed: 77,
        ..Settings::default()
    };
    let reference = finish(&scene, &aimed(&scene, &settings, &aims))?.solution;
    for parts in &reference.account {
        eprintln!("{name}: reference {parts:?}");
    }
    let of_reference = organ_spread(&scene.canopy.plants(), &reference);
    let judge = move |solution: &Solution| {
        let apart = |band: usize| {
            let apart = apart_percent(solution, &reference, band);
            let own = of_reference[band].rms_percent.unwrap_or(0.0);
            (apart * apart - own * own).max(0.0).sqrt()
        };
        (0..2).map(apart).collect()
    };
    Ok(Case {
        name,
        scene,
        judge: Box::new(judge),
    })
}

/// A sample scene, judged by its Monte Carlo solution.
fn by_particles(name: &'static str, soil_m: f64) -> Option<Case> {
    let folder = shared()?;
    let scene = sample(&folder, name, soil_m);
    let (reference, copy) = (organs(&folder, name), scene.clone());
    let judge = move |solution: &Solution| {
        let percent = |band| 100.0 * misfit(&copy, solution, &reference, band).rms;
        (0..2).map(percent).collect()
    };
    Some(Case {
        name,
        scene,
        judge: Box::new(judge),
    })
}

fn run(case: &Case, percent: f64, seed: u64) -> Result<String, Fault> {
    let settings = Settings {
        accuracy_percent: percent,
        in_rounds: true,
        seed,
        ..Settings::default()
    };
    let watch = Stopwatch::start();
    let solved = in_rounds(&case.scene, &settings)?;
    let cpu_s = watch.usage().cpu_s;
    let errors = (case.judge)(&solved.solution);
    let stated = solved.accuracy.errors.iter();
    let stated: Vec<f64> = stated.map(BandAccount::total_percent).collect();
    let worst = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    Ok(format!(
        "{},{percent},{seed},{},{:.2},{:.3},{:.3},{:.3},{:.3},{:?}",
        case.name,
        solved.accuracy.rounds.len(),
        cpu_s,
        worst(&errors),
        worst(&stated),
        errors[0],
        errors[1],
        solved.accuracy.ended,
    ))
}

fn main() -> Result<(), Fault> {
    let wide = Maize {
        stand: Stand {
            rows: 1,
            plants_per_row: 2,
            row_spacing_m: 1.5,
            plant_spacing_m: 0.5,
        },
        ..Maize::default()
    };
    let homogeneous = small_leaves(3.0, LeafAngles::Spherical, 0.01, 5);
    let mut cases = vec![
        by_rays("maize", &small_maize())?,
        by_rays("sparse maize", &wide.generate()?)?,
        by_rays("homogeneous", &homogeneous)?,
    ];
    cases.extend(by_particles("maize_rows", -0.002));
    cases.extend(by_particles("bean_rows", -0.010));
    let mut csv = "scene,asked_percent,seed,rounds,cpu_s,true_percent,stated_percent,true_first_band_percent,true_second_band_percent,ended\n".to_owned();
    let (mut runs, mut below, mut fine) = (0, 0, 0);
    for case in &cases {
        for percent in TARGETS_PERCENT {
            for seed in SEEDS {
                let line = run(case, percent, seed)?;
                eprintln!("{line}");
                let error: f64 = line.split(',').nth(5).unwrap_or_default().parse()?;
                runs += 1;
                below += usize::from(error <= percent);
                fine += usize::from(error >= percent / 3.0);
                let _ = writeln!(csv, "{line}");
            }
        }
    }
    eprintln!("{runs} runs, {below} below what was asked for, {fine} above a third of it");
    let figures = concat!(env!("CARGO_MANIFEST_DIR"), "/../master/docs/figures");
    fs::write(format!("{figures}/honest.csv"), csv)?;
    Ok(())
}
