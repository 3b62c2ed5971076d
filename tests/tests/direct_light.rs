//! Light that comes straight from the sources, where it can be told with a ruler.

#![allow(clippy::unwrap_used)]

use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec2, DVec3};
use nestrad_common::light::Sources;
use nestrad_common::scene::Scene;
use nestrad_engine::direct::direct_light;
use nestrad_engine::frame::Frame;
use nestrad_engine::plan::Settings;
use nestrad_engine::stop::Stopped;
use nestrad_tests::enclosure::full_plate;
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{frame, plan, solve};
use nestrad_tests::statistics::{assert_close, assert_within, mean_and_deviation};

/// What organs absorb of direct light, by lattices of lines of that pitch: mean over 16 seeds and its
/// standard error, W.
fn absorbed(scene: &Scene, pitch_m: f64) -> Vec<(f64, f64)> {
    let (frame, sources) = framed(scene);
    let optics = frame.ordered(&scene.optics);
    let areas = vec![pitch_m * pitch_m; sources.list.len()];
    let runs: Vec<Vec<f64>> = (1..=16)
        .map(|seed| {
            let projections = (&sources, &areas[..]);
            let direct = direct_light(&frame, &optics, projections, seed, || Ok(())).unwrap();
            let mut organs = vec![0.0; frame.organs];
            for (e, &t) in frame.triangle_of_element.iter().enumerate() {
                // black on both faces
                let both = direct.irradiance_W_m2[2 * e] + direct.irradiance_W_m2[2 * e + 1];
                let organ = frame.order.organ[frame.organ[t as usize] as usize];
                organs[organ as usize] += both * frame.area_m2[e];
            }
            organs
        })
        .collect();
    (0..frame.organs)
        .map(|o| {
            let values: Vec<f64> = runs.iter().map(|run| run[o]).collect();
            let (mean, deviation) = mean_and_deviation(&values);
            (mean, deviation / 4.0)
        })
        .collect()
}

/// A scene in its frame, as planned, with its sources.
fn framed(scene: &Scene) -> (Frame, Sources) {
    let plan = plan(scene, &Settings::default());
    let sources = Sources {
        list: scene.light.suns.clone(),
        sky_directions: 0,
        sky: None,
    };
    (frame(&scene.canopy, &plan.trace), sources)
}

/// To the last row of lines: one row of 5 mm is 0.5 % of a plate of a metre.
#[test]
fn an_isolated_plate_gets_the_light_of_its_area() {
    for zenith in [0.0, 5.0, 30.0, 70.0] {
        let mut scenery = Scenery::open();
        scenery.level("plate", DVec3::ZERO, DVec2::new(1.0, 0.6));
        // makes the scene higher than the plate
        scenery.level("marker", DVec3::new(0.5, 0.3, -0.2), DVec2::splat(0.01));
        scenery.band("B", 0.0, &[]);
        scenery.source(from_zenith(zenith, 25.0), 100.0);
        let (mean, se) = absorbed(&scenery.scene(), 0.005)[0];
        // vertical lines on a plate as large as the scene are always as many
        let se = se.max(1e-6);
        assert_close(&format!("zenith {zenith}"), mean, 60.0, se, 4.0, 0.15);
    }
}

/// A vertical plate gets I tan(theta) cos(azimuth), on the side of the source alone.
#[test]
fn a_vertical_plate_is_lit_on_one_side() {
    let mut scenery = Scenery::open();
    let at = |y: f64, z: f64| DVec3::new(0.0, y, z);
    // upper face towards +x
    scenery.quad(
        "plate",
        [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
    );
    scenery.band("B", 0.0, &[]);
    scenery.source(from_zenith(60.0, 40.0), 100.0);
    let item = solve(&scenery.scene(), &Settings::default())
        .solution
        .organs[0];
    let expected = 100.0 * 60f64.to_radians().tan() * 40f64.to_radians().cos();
    assert_within(
        "upper",
        item.irradiance_upper_W_m2,
        expected,
        0.002 * expected,
    );
    assert_eq!(item.irradiance_lower_W_m2, 0.0);
}

/// In a periodic scene what one leaf takes is missing below, under any sun, however often its shadow
/// wraps around the pattern.
#[test]
fn the_shadow_of_a_leaf_wraps_around_the_pattern() {
    for zenith in [10.0, 60.0, 85.0] {
        let mut scenery = Scenery::periodic(DVec2::new(0.5, 0.4)).soil(0.0);
        scenery.level("leaf 1", DVec3::new(0.4, 0.3, 0.7), DVec2::new(0.3, 0.2));
        // in the shadow of all the others, for it fills the pattern
        full_plate(&mut scenery, "leaf 2", 0.1, DVec2::new(0.2, 0.3));
        scenery.band("B", 0.0, &[]);
        scenery.source(from_zenith(zenith, 200.0), 100.0);
        let found = absorbed(&scenery.scene(), 0.001);
        for (o, expected) in [(0, 6.0), (1, 14.0)] {
            let (mean, se) = found[o];
            let what = format!("leaf {} at {zenith}", o + 1);
            assert_close(&what, mean, expected, se, 4.0, 0.03);
        }
    }
}

/// It went on to the last source of a sky, minutes on a large field.
#[test]
fn what_is_cancelled_stops_at_the_next_source() {
    let mut scenery = Scenery::open();
    scenery.level("plate", DVec3::ZERO, DVec2::new(1.0, 0.6));
    scenery.band("B", 0.0, &[]);
    for k in 0..200 {
        scenery.source(from_zenith(f64::from(k) * 0.4, 25.0), 1.0);
    }
    let scene = scenery.scene();
    let (frame, sources) = framed(&scene);
    let optics = frame.ordered(&scene.optics);
    let (asked, enough) = (AtomicUsize::new(0), 10);
    let step = || match asked.fetch_add(1, Ordering::Relaxed) {
        before if before < enough => Ok(()),
        _ => Err(Stopped),
    };
    let projections = (&sources, &[1e-4; 200][..]);
    let stopped = direct_light(&frame, &optics, projections, 1, step);
    assert!(matches!(stopped, Err(Stopped)));
    // one source more of each group that was at work
    assert!(asked.into_inner() < enough + 16);
}
