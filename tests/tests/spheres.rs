//! Near exchange within a sphere, the rest through the far field (DESIGN, sections 2 and 3).

#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stderr, reason = "the figures are worth reading")]

use nestrad_common::generate::LeafAngles;
use nestrad_common::options::Diameter;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_engine::solution::Solution;
use nestrad_tests::canopies::{par_and_nir, scenery, small_leaves, small_maize, uniform_sky};
use nestrad_tests::scenery::from_zenith;
use nestrad_tests::solving::{finish, plan, shares};
use nestrad_tests::statistics::{mean_and_deviation, median};

fn maize(periodic: bool) -> Scene {
    let mut scenery = scenery(&small_maize(), &par_and_nir(), Vec::new());
    if !periodic {
        scenery.pattern = None;
    }
    scenery.source(from_zenith(40.0, 160.0), 400.0);
    scenery.scene()
}

fn within(scene: &Scene, diameter: Diameter) -> Solution {
    let settings = Settings {
        diameter,
        ..Settings::default()
    };
    finish(scene, &plan(scene, &settings)).unwrap().solution
}

/// Longer than any line of sight: the lowest of a few thousand directions stands about 1e-4 above the
/// horizon, and the scene is 2 m high.
const LONGER_M: f64 = 1e7;

#[test]
fn a_sphere_larger_than_a_periodic_scene_changes_no_bit() {
    let scene = maize(true);
    let whole = within(&scene, Diameter::Infinite);
    assert!(whole == within(&scene, Diameter::Metres(LONGER_M)));
}

#[test]
fn a_sphere_larger_than_an_isolated_scene_changes_no_bit() {
    let scene = maize(false);
    let whole = within(&scene, Diameter::Infinite);
    assert!(whole == within(&scene, Diameter::Metres(LONGER_M)));
    // no plants are farther apart than 10 m: what leaves them sideways sees the sky, or the soil
    assert!(whole == within(&scene, Diameter::Metres(20.0)));
}

/// Organs against plain radiosity: the error falls as the sphere grows, and energy stays conserved.
#[test]
fn a_growing_sphere_comes_ever_closer_to_plain_radiosity() {
    let scene = maize(true);
    let whole = within(&scene, Diameter::Infinite);
    for band in 0..2 {
        let mut last = f64::INFINITY;
        for diameter in [0.2, 0.8, 3.2] {
            let part = within(&scene, Diameter::Metres(diameter));
            let (mut error2, mut all2) = (0.0, 0.0);
            for (a, b) in whole.organs.iter().zip(&part.organs).skip(band).step_by(2) {
                error2 += (a.absorbed_W - b.absorbed_W).powi(2);
                all2 += a.absorbed_W.powi(2);
            }
            let error = (error2 / all2).sqrt();
            let closure = shares(&part, band).closure;
            let se = part.balance[band].closure_W.se / part.balance[band].incoming_W;
            eprintln!("band {band}, D = {diameter} m: {error:.4}, closure {closure:.4} ± {se:.4}");
            assert!(
                error <= last.max(0.003),
                "band {band}, D = {diameter} m: {error}"
            );
            // what one end of a long line of sight sends out is what the others get: only sampling is left
            assert!(
                closure.abs() < 3.0 * se && se < 0.005,
                "band {band}, D = {diameter} m: closure {closure} ± {se}"
            );
            last = error;
        }
        assert!(last < 0.01, "band {band}: {last}");
    }
}

/// Over seeds, at a coarse accuracy: the balance closes within its stated error, and organs scatter as theirs
/// say, however much of the exchange is the far field's.
#[test]
fn stated_errors_hold_what_the_far_field_samples() {
    let leaves = small_leaves(2.0, LeafAngles::Spherical, 1.5e-2, 5);
    let scene = scenery(&leaves, &par_and_nir(), uniform_sky(12, 2)).scene();
    for diameter in [0.02, 0.3, 1.0] {
        let solutions: Vec<Solution> = (1..=20)
            .map(|seed| {
                let settings = Settings {
                    diameter: Diameter::Metres(diameter),
                    accuracy_percent: 5.0,
                    seed,
                    ..Settings::default()
                };
                finish(&scene, &plan(&scene, &settings)).unwrap().solution
            })
            .collect();
        for band in 0..2 {
            let closures = || solutions.iter().map(|s| s.balance[band].closure_W);
            let off: Vec<f64> = closures().map(|c| c.value).collect();
            let stated = rms(closures().map(|c| c.se));
            let (mean, scatter) = mean_and_deviation(&off);
            let (mean, scatter) = (mean / stated, scatter / stated);
            let organs: Vec<f64> = (0..scene.canopy.organs.len())
                .map(|o| {
                    let items = || solutions.iter().map(|s| &s.organs[2 * o + band]);
                    let absorbed: Vec<f64> = items().map(|i| i.absorbed_W).collect();
                    mean_and_deviation(&absorbed).1 / rms(items().map(|i| i.absorbed_se_W))
                })
                .collect();
            let organ = median(organs);
            let what = format!(
                "D = {diameter} m, band {band}: closure {mean:.2} ± {scatter:.2} of its stated errors, \
                 organs scatter {organ:.2} of theirs"
            );
            eprintln!("{what}");
            // the scatter of 20 is known to a sixth of it, their mean to a quarter
            assert!(mean.abs() < 0.75, "{what}");
            assert!((0.6..1.5).contains(&scatter), "{what}");
            assert!((0.75..1.25).contains(&organ), "{what}");
        }
    }
}

fn rms(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len() as f64;
    (values.map(|v| v * v).sum::<f64>() / n).sqrt()
}
