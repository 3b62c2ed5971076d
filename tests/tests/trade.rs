//! A study of speed and accuracy on a small canopy.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]
#![allow(clippy::unwrap_used, reason = "what cannot be set up fails the test")]

use nestrad_common::options::Diameter;
use nestrad_results::trade::request::Request;
use nestrad_results::trade::setting::{Setting, grid};
use nestrad_results::trade::study::{SettingRun, carry_out};
use nestrad_results::trade::table::Comparison;
use nestrad_results::trade::{About, write};
use nestrad_tests::canopies::{par_and_nir, scenery, small_maize, uniform_sky};
use nestrad_tests::solving::unwatched;

#[test]
fn errors_fall_with_accuracy_and_a_second_study_computes_nothing() {
    let scene = scenery(&small_maize(), &par_and_nir(), uniform_sky(46, 2)).scene();
    let folder = tempfile::tempdir().unwrap();
    let settings = [5.0, 0.7, 0.35].map(Setting::asked);
    let request = Request {
        scene: &scene,
        out: folder.path(),
        settings: &settings,
        finest_percent: 0.5,
        memory_GiB: 4.0,
        runs: 2,
        seed: 1,
    };
    let study = || unwatched(|run| carry_out(&request, run, |_| {})).unwrap();
    let first = study();
    assert_eq!(first.computed, 3 + 2 * settings.len());
    let again = study();
    assert_eq!(again.computed, 0);
    assert_eq!(again.measured, first.measured);
    let written = [&first, &again].map(|study| {
        let comparison = Comparison::of(&request, study);
        for choice in &comparison.choices {
            if let Ok(row) = choice.chosen {
                let chosen = comparison.rows[row].outcome.as_ref().unwrap();
                let highs = chosen.errors.iter().map(|error| error.high_percent);
                assert!(highs.fold(0.0, f64::max) <= choice.target_percent);
            }
        }
        assert!(comparison.choices[0].chosen.is_ok());
        let about = About {
            title: "small maize",
            runs: request.runs,
            threads: 2,
        };
        write(folder.path(), &about, &comparison).unwrap();
        ["trade.csv", "trade.html"].map(|name| std::fs::read(folder.path().join(name)).unwrap())
    });
    assert!(written[0] == written[1]);
    let of_band = |band: usize| -> Vec<f64> {
        let of_setting = |runs: &Result<Vec<SettingRun>, String>| {
            let runs = runs.as_ref().unwrap().iter();
            let squares: Vec<f64> = runs.map(|r| r.square_percent2[band]).collect();
            first.bands[band].1.range(&squares).percent
        };
        first.measured.iter().map(of_setting).collect()
    };
    let mut worst = vec![0.0; settings.len()];
    for (band, (name, _)) in first.bands.iter().enumerate() {
        let errors = of_band(band);
        assert!(
            errors[1..].iter().all(|e| *e < errors[0]),
            "{name}: {errors:?}"
        );
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = f64::max(*worst, error);
        }
    }
    // the worst band is what is asked for: what another has to spare is taken from it
    assert!(worst.is_sorted_by(|a, b| a > b), "{worst:?}");
    for (error, asked) in worst.iter().zip([5.0, 0.7, 0.35]) {
        assert!(*error < 1.2 * asked, "{worst:?}");
    }
}

#[test]
fn a_grid_has_nothing_far_finer_than_its_finest_target() {
    let scene = scenery(&small_maize(), &par_and_nir(), uniform_sky(46, 2)).scene();
    let settings = grid(&scene.canopy, 2.0);
    assert!(
        settings.iter().all(|s| s.accuracy_percent >= 1.6),
        "{settings:?}"
    );
    let spheres = settings.iter().filter(|s| s.diameter != Diameter::Infinite);
    assert!(spheres.count() > 3, "{settings:?}");
    let finer = grid(&scene.canopy, 0.2);
    let names: Vec<String> = finer.iter().map(ToString::to_string).collect();
    assert!(
        finer.len() > settings.len() && finer.len() < 40,
        "{names:?}"
    );
}
