//! Lines and rays are independent estimators of one exchange: they must agree within their errors, and
//! the errors that they state must be true.

#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stderr, reason = "the figures are worth reading")]

use nestrad_common::generate::{Generated, LeafAngles, LeafShape, RandomCanopy};
use nestrad_common::scene::Scene;
use nestrad_engine::plan::{Estimator, Settings};
use nestrad_engine::solution::Balance;
use nestrad_kernel::ends::Side;
use nestrad_tests::canopies::{par_and_nir, scenery, small_maize, uniform_sky};
use nestrad_tests::form_factor::Traced;
use nestrad_tests::scenery::from_zenith;
use nestrad_tests::solving::{Solved, by, coarse, finish, plan, sampling};
use nestrad_tests::statistics::{mean_and_deviation, median};

fn lit(generated: &Generated) -> Scene {
    let mut scenery = scenery(generated, &par_and_nir(), uniform_sky(8, 2));
    scenery.source(from_zenith(40.0, 160.0), 400.0);
    scenery.scene()
}

fn maize() -> Scene {
    lit(&small_maize())
}

fn discs() -> Scene {
    let canopy = RandomCanopy {
        leaf_area_index: 3.0,
        angles: LeafAngles::Planophile,
        shape: LeafShape::Disc,
        leaf_m2: 2e-3,
        size_m: glam::DVec2::new(0.4, 0.3),
        height_m: 0.5,
        seed: 2,
    };
    lit(&canopy.generate().unwrap())
}

fn solved(scene: &Scene, estimator: Estimator, rays: f64, seed: u64) -> Solved {
    let settings = Settings {
        seed,
        ..by(estimator)
    };
    let mut plan = plan(scene, &settings);
    if let (Estimator::Rays, Some(sampling)) = (estimator, &mut plan.trace.sampling) {
        sampling.least_samples = rays;
    }
    finish(scene, &plan).unwrap()
}

/// Of 360 values of discs, 0 to 4 are beyond 3 standard errors from seed to seed: three seeds together.
#[test]
fn lines_and_rays_agree() {
    for (name, scene, rays, seeds) in [("maize", maize(), 128.0, 1), ("discs", discs(), 256.0, 3)] {
        let (mut beyond, mut organs) = (0, 0);
        for seed in 1..=seeds {
            let lines = solved(&scene, Estimator::Lines, 0.0, seed).solution;
            let rays = solved(&scene, Estimator::Rays, rays, seed).solution;
            for b in 0..2 {
                balances_agree(name, &lines.balance[b], &rays.balance[b]);
                for o in 0..scene.canopy.organs.len() {
                    let (l, r) = (&lines.organs[2 * o + b], &rays.organs[2 * o + b]);
                    // both share the direct light, lattice and all
                    let se = l.absorbed_se_W.hypot(r.absorbed_se_W);
                    organs += 1;
                    beyond += usize::from((l.absorbed_W - r.absorbed_W).abs() > 3.0 * se);
                }
            }
        }
        eprintln!("{name}: {beyond} of {organs} beyond 3 standard errors");
        assert!(100 * beyond <= organs, "{name}: {beyond} of {organs}");
    }
}

fn balances_agree(name: &str, lines: &Balance, rays: &Balance) {
    let name = format!("{name}, {}", lines.band);
    for (part, l, r) in [
        ("plants", lines.absorbed_plants_W, rays.absorbed_plants_W),
        ("soil", lines.absorbed_soil_W, rays.absorbed_soil_W),
        ("up", lines.escaped_up_W, rays.escaped_up_W),
    ] {
        let incoming = lines.incoming_W;
        let (off, se) = ((l.value - r.value) / incoming, l.se.hypot(r.se) / incoming);
        eprintln!("{name} {part}: {off:.5} ± {se:.5}");
        assert!(se < 2e-3, "{name} {part}: {se}");
        assert!(off.abs() < f64::max(1e-3, 3.0 * se), "{name} {part}: {off}");
    }
}

/// A(i) F(i,j) of one half of the lines is A(j) F(j,i) of the other half within their errors.
#[test]
fn exchange_of_two_organs_is_mutual() {
    let scene = maize();
    let sampling = sampling(Estimator::Lines, 0.006, 0.0);
    let traced = Traced::new(&scene.canopy, 0.05, &sampling);
    let organs = scene.canopy.organs.len();
    let sides = [Side::Upper, Side::Lower];
    let (mut z, mut beyond) = (Vec::new(), 0);
    for i in 0..organs {
        for j in 0..i {
            for (s, t) in sides.iter().flat_map(|s| sides.map(|t| (*s, t))) {
                let (from, to) = (traced.rows(i, s), traced.rows(j, t));
                if traced.is_solid(i) || traced.is_solid(j) {
                    continue;
                }
                let area = |rows: &[usize]| -> f64 {
                    rows.iter().map(|&r| traced.frame.row_area_m2(r)).sum()
                };
                let there = traced.part_seen(&from, &[0], |end| traced.is(end, j, t));
                let back = traced.part_seen(&to, &[1], |end| traced.is(end, i, s));
                let (a, b) = (area(&from), area(&to));
                let se = (a * there.se).hypot(b * back.se);
                // a few lines have no normal distribution
                if there.value * a < 1e-4 {
                    continue;
                }
                z.push((a * there.value - b * back.value) / se);
            }
        }
    }
    for z in &z {
        beyond += usize::from(z.abs() > 4.0);
    }
    let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
    let mean = z.iter().sum::<f64>() / z.len() as f64;
    eprintln!(
        "{} pairs: rms {rms:.2}, mean {mean:.2}, {beyond} beyond 4",
        z.len()
    );
    assert!(z.len() > 100);
    assert!((0.7..1.3).contains(&rms), "rms {rms}");
    assert!(100 * beyond <= z.len(), "{beyond} of {}", z.len());
}

/// Over 20 seeds: rms of (value - mean) / stated error, for the median organ.
#[test]
fn stated_errors_are_true() {
    const SEEDS: u64 = 20;
    let scene = discs();
    let (organs, bands) = (scene.canopy.organs.len(), scene.optics.len());
    let runs: Vec<Solved> = (1..=SEEDS)
        .map(|seed| {
            let settings = Settings { seed, ..coarse() };
            finish(&scene, &plan(&scene, &settings)).unwrap()
        })
        .collect();
    for b in 0..bands {
        let ratios: Vec<f64> = (0..organs)
            .filter(|&o| runs[0].solution.organ_area_m2[o] > 1e-4)
            .map(|o| {
                let of = |k: usize| &runs[k].solution.organs[o * bands + b];
                let values: Vec<f64> = (0..runs.len()).map(|k| of(k).absorbed_W).collect();
                let (mean, _) = mean_and_deviation(&values);
                let n = values.len() as f64;
                let squares = (0..runs.len())
                    .map(|k| ((of(k).absorbed_W - mean) / of(k).absorbed_se_W).powi(2));
                // the mean is of the same values
                (squares.sum::<f64>() / (n - 1.0)).sqrt()
            })
            .collect();
        let middle = median(ratios.clone());
        let (low, high) = (
            ratios.iter().copied().fold(f64::INFINITY, f64::min),
            ratios.iter().copied().fold(0.0, f64::max),
        );
        eprintln!("band {b}: median {middle:.3}, from {low:.2} to {high:.2}");
        assert!(
            (0.8..=1.25).contains(&middle),
            "band {b}: median {middle:.3}"
        );
    }
}
