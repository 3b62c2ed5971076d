//! What must hold for every scene: repeatability, symmetry, linearity, energy.

#![allow(clippy::unwrap_used)]

use glam::DVec3;
use nestrad_common::canopy::Triangle;
use nestrad_common::optics::LeafOptics;
use nestrad_engine::exchange::BlockOf;
use nestrad_engine::plan::Settings;
use nestrad_engine::solution::Solution;
use nestrad_tests::canopies::{par_and_nir, scenery, small_maize, uniform_sky};
use nestrad_tests::cutting::InBlocks;
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{ESTIMATORS, coarse, finish, frame, plan, shares, solve, trace};
use nestrad_tests::statistics::assert_within;
use proptest::prelude::*;

/// A small periodic canopy of two bands, a sun and a sky.
fn maize() -> Scenery {
    let mut scenery = scenery(&small_maize(), &par_and_nir(), uniform_sky(4, 2));
    scenery.source(from_zenith(40.0, 160.0), 400.0);
    scenery
}

/// How far the organs of two solutions are apart: rms of difference over combined standard error.
fn rms_z(a: &Solution, b: &Solution) -> f64 {
    let z2: Vec<f64> = a
        .organs
        .iter()
        .zip(&b.organs)
        .filter(|(a, b)| a.absorbed_se_W + b.absorbed_se_W > 0.0)
        .map(|(a, b)| {
            let se = a.absorbed_se_W.hypot(b.absorbed_se_W);
            ((a.absorbed_W - b.absorbed_W) / se).powi(2)
        })
        .collect();
    (z2.iter().sum::<f64>() / z2.len() as f64).sqrt()
}

#[test]
fn one_thread_and_two_give_the_same_bits() {
    let scene = maize().scene();
    for estimator in ESTIMATORS {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| {
                let mut plan = plan(
                    &scene,
                    &Settings {
                        estimator,
                        ..coarse()
                    },
                );
                if let Some(sampling) = &mut plan.trace.sampling {
                    sampling.least_samples = sampling.least_samples.min(16.0);
                }
                finish(&scene, &plan).unwrap().solution
            })
        };
        let one = on(1);
        assert!(one == on(2), "{estimator:?}: two threads differ from one");
        assert!(one == on(3), "{estimator:?}: three threads differ from one");
    }
}

/// The scene as one job, or as several that own every third triangle and some soil each.
#[test]
fn one_job_and_many_give_the_same_bits() {
    let scene = maize().scene();
    let plan = plan(&scene, &coarse());
    let mut sampling = plan.trace.sampling.unwrap();
    sampling.batches = 2;
    let frame = frame(&scene.canopy, &plan.trace);
    let whole = BlockOf::whole(&frame);
    let parts: Vec<BlockOf> = (0..3)
        .map(|part| BlockOf {
            triangles: whole
                .triangles
                .iter()
                .map(|&(t, _)| (t, t % 3 == part))
                .collect(),
            soil_cells: whole
                .soil_cells
                .iter()
                .copied()
                .filter(|c| c / 100 % 3 == part)
                .collect(),
        })
        .collect();
    let of = |blocks: Vec<BlockOf>| trace(&frame, &sampling, &InBlocks(blocks)).halves;
    assert!(of(vec![whole]) == of(parts), "rows differ");
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_does_not() {
    let scene = maize().scene();
    let with = |seed| {
        let settings = Settings { seed, ..coarse() };
        solve(&scene, &settings).solution
    };
    let first = with(1);
    assert!(first == with(1));
    assert!(first.organs != with(2).organs);
}

/// Direct light alone is sampled, too.
#[test]
fn another_seed_samples_a_black_canopy_elsewhere() {
    let black = [(LeafOptics::default(), 0.0)];
    let mut scenery = scenery(&small_maize(), &black, uniform_sky(2, 1));
    scenery.bands[0].materials.fill(LeafOptics::default());
    let scene = scenery.scene();
    let with = |seed| {
        let settings = Settings { seed, ..coarse() };
        solve(&scene, &settings).solution
    };
    assert!(with(1).organs != with(2).organs);
}

/// A mirrored canopy under mirrored light: with every triangle turned over to keep its upper face up.
#[test]
fn a_mirrored_scene_gets_the_same_light() {
    let scenery = maize();
    let mirror = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
    let mut mirrored = scenery.clone();
    for triangle in &mut mirrored.triangles {
        let [a, b, c] = triangle.corners_m.map(mirror);
        triangle.corners_m = [a, c, b];
    }
    for source in &mut mirrored.sources {
        source.direction = mirror(source.direction);
    }
    // the pattern is centred on the origin
    let settings = coarse();
    let z = rms_z(
        &solve(&scenery.scene(), &settings).solution,
        &solve(&mirrored.scene(), &settings).solution,
    );
    assert!(
        (0.5..1.4).contains(&z),
        "rms difference over its standard error: {z:.2}"
    );
}

/// Not in a single bit (`order`).
#[test]
fn the_order_of_triangles_means_nothing() {
    let scenery = maize();
    let mut shuffled = scenery.clone();
    let n = scenery.triangles.len();
    // a step without a common divisor goes through all of them
    let step = (n / 2 + 1..).find(|&s| gcd(s, n) == 1).unwrap();
    for (to, from) in (0..n).map(|k| (k, k * step % n)) {
        shuffled.triangles[to] = scenery.triangles[from];
    }
    let settings = coarse();
    let a = solve(&scenery.scene(), &settings).solution;
    let b = solve(&shuffled.scene(), &settings).solution;
    assert!(a.organs == b.organs, "organs differ");
    assert!(a.balance == b.balance, "balances differ");
    for k in 0..n {
        let from = k * step % n;
        assert!(
            a.triangles[2 * from..2 * from + 2] == b.triangles[2 * k..2 * k + 2],
            "triangle {from} differs"
        );
    }
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Turning a triangle over, with the properties of its faces exchanged, exchanges what they get.
#[test]
fn a_triangle_turned_over_swaps_its_faces() {
    let scenery = maize();
    let mut turned = scenery.clone();
    let solid = |triangle: &Triangle| triangle.material == 0;
    for triangle in &mut turned.triangles {
        if !solid(triangle) {
            triangle.corners_m.swap(1, 2);
        }
    }
    for band in &mut turned.bands {
        let LeafOptics { upper, lower } = band.materials[1];
        band.materials[1] = LeafOptics {
            upper: lower,
            lower: upper,
        };
    }
    let settings = coarse();
    let a = solve(&scenery.scene(), &settings).solution;
    let b = solve(&turned.scene(), &settings).solution;
    let largest = a.organs.iter().map(|i| i.absorbed_W).fold(0.0, f64::max);
    for (k, (a, b)) in a.organs.iter().zip(&b.organs).enumerate() {
        let stem = scenery.organs[k / 2].id.ends_with("000");
        let (up, low) = if stem {
            (b.irradiance_upper_W_m2, b.irradiance_lower_W_m2)
        } else {
            (b.irradiance_lower_W_m2, b.irradiance_upper_W_m2)
        };
        // few leaves have thin triangles, which rays complete, with random numbers by face
        let bound = 0.02 * a.irradiance_upper_W_m2.max(a.irradiance_lower_W_m2);
        assert_within("upper", a.irradiance_upper_W_m2, up, bound);
        assert_within("lower", a.irradiance_lower_W_m2, low, bound);
        assert_within("absorbed", a.absorbed_W, b.absorbed_W, 1e-3 * largest);
    }
}

/// The exchange does not depend on the light, and the light adds up.
#[test]
fn light_of_two_sources_adds_up() {
    let scenery = maize();
    let (sun, sky) = scenery.sources.split_last().unwrap();
    let with = |sources: Vec<_>| {
        let part = Scenery {
            sources,
            ..scenery.clone()
        };
        solve(&part.scene(), &Settings::default()).solution
    };
    let both = with(scenery.sources.clone());
    let (sun, sky) = (with(vec![sun.clone()]), with(sky.to_vec()));
    let z2: Vec<f64> = (0..both.organs.len())
        .map(|k| {
            let [all, sun, sky] = [&both, &sun, &sky].map(|s| &s.organs[k]);
            let se = all
                .absorbed_se_W
                .hypot(sun.absorbed_se_W)
                .hypot(sky.absorbed_se_W);
            ((sun.absorbed_W + sky.absorbed_W - all.absorbed_W) / se).powi(2)
        })
        .collect();
    // the exchange is the same in all three: only lattices of the direct light differ
    let z = (z2.iter().sum::<f64>() / z2.len() as f64).sqrt();
    assert!(z < 1.4, "rms difference over its standard error: {z:.2}");
    for band in 0..2 {
        let absorbed = |s: &Solution| s.balance[band].absorbed_plants_W.value;
        let (sum, all) = (absorbed(&sun) + absorbed(&sky), absorbed(&both));
        assert_within("all plants", sum / all, 1.0, 2e-3);
    }
}

#[test]
fn twice_the_light_gives_exactly_twice_the_results() {
    let scenery = maize();
    let mut twice = scenery.clone();
    for source in &mut twice.sources {
        source.irradiance_W_m2.iter_mut().for_each(|e| *e *= 2.0);
    }
    let settings = coarse();
    let once = solve(&scenery.scene(), &settings).solution;
    let twice = solve(&twice.scene(), &settings).solution;
    for (a, b) in once.organs.iter().zip(&twice.organs) {
        assert_eq!(2.0 * a.absorbed_W, b.absorbed_W);
        assert_eq!(2.0 * a.irradiance_lower_W_m2, b.irradiance_lower_W_m2);
        assert_eq!(2.0 * a.absorbed_direct_W, b.absorbed_direct_W);
    }
}

/// Two to twelve triangles anywhere, some of them across each other and past the edges.
fn any_scenery() -> impl Strategy<Value = Scenery> {
    let unit = || 0.0f64..1.0;
    let corner = move || (unit(), unit(), unit()).prop_map(|(x, y, z)| DVec3::new(x, y, z));
    let triangle = move || (corner(), corner(), corner()).prop_map(|(a, b, c)| [a, b, c]);
    let optics = move || {
        (unit(), unit(), unit(), unit()).prop_map(|(a, b, c, d)| {
            let face = |all: f64, part: f64| nestrad_common::optics::FaceOptics {
                rho: all * part,
                tau: all * (1.0 - part),
            };
            LeafOptics {
                upper: face(a, b),
                lower: face(c, d),
            }
        })
    };
    (
        prop::collection::vec(triangle(), 2..12),
        optics(),
        unit(),
        0.0f64..80.0,
        0.0f64..360.0,
        any::<bool>(),
        any::<bool>(),
    )
        .prop_map(
            |(triangles, leaf, soil, zenith, azimuth, periodic, grounded)| {
                let grounded = grounded && periodic;
                let scenery = if periodic {
                    Scenery::periodic(glam::DVec2::new(0.7, 0.9))
                } else {
                    Scenery::open()
                };
                let mut scenery = if grounded {
                    scenery.soil(-0.05)
                } else {
                    scenery
                };
                for (k, triangle) in triangles.into_iter().enumerate() {
                    scenery.triangle(&format!("leaf {k}"), triangle);
                }
                scenery.band("B", soil, &[("leaf", leaf)]);
                scenery.source(from_zenith(zenith, azimuth), 100.0);
                scenery
            },
        )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// Nothing absorbs less than nothing, all together no more than comes in, and what comes in is
    /// accounted for.
    #[test]
    fn energy_is_conserved(scenery in any_scenery()) {
        let scene = scenery.scene();
        let mut plan = plan(&scene, &coarse());
        (plan.trace.max_edge_m, plan.light.direct_line_area_m2) = (0.1, 1e-4);
        if let Some(sampling) = &mut plan.trace.sampling {
            sampling.line_area_m2 = 4e-4;
        }
        let solution = finish(&scene, &plan).unwrap().solution;
        // a sheet on edge under light along it
        prop_assume!(solution.balance[0].incoming_W > 0.0);
        let found = shares(&solution, 0);
        for part in [found.plants, found.soil, found.up, found.down] {
            prop_assert!((0.0..=1.0 + 0.02).contains(&part), "{found:?}");
        }
        let se = solution.balance[0].closure_W.se / solution.balance[0].incoming_W;
        prop_assert!(found.closure.abs() < 0.01 + 4.0 * se && se < 0.02, "{found:?} ± {se}");
        for item in &solution.organs {
            prop_assert!(item.absorbed_W >= 0.0 && item.absorbed_se_W.is_finite());
            prop_assert!(item.absorbed_direct_W <= item.absorbed_W * (1.0 + 1e-9) + 1e-9);
        }
    }
}

/// An isolated plant on soil: light that comes in from the soil around the map, and that goes there, is
/// part of the balance.
#[test]
fn energy_is_conserved_on_open_soil() {
    let mut scenery = Scenery::open().soil(-0.05);
    scenery.triangle(
        "leaf",
        [DVec3::ZERO, 0.6 * DVec3::Z, 0.5 * DVec3::Y + 0.1 * DVec3::X],
    );
    scenery.band("B", 0.8, &[]);
    scenery.source(from_zenith(0.0, 0.0), 100.0);
    let found = shares(&solve(&scenery.scene(), &coarse()).solution, 0);
    assert_within(&format!("closure of {found:?}"), found.closure, 0.0, 0.005);
}
