//! What must hold for every scene: repeatability, symmetry, linearity, energy.

#![allow(clippy::unwrap_used)]

use glam::DVec3;
use nestrad_common::optics::LeafOptics;
use nestrad_common::problem::Problem;
use nestrad_master::exchange::{BlockOf, trace_here};
use nestrad_master::plan::Settings;
use nestrad_master::solution::Solution;
use nestrad_tests::canopies::{par_and_nir, problem, small_maize, uniform_sky};
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{ESTIMATORS, coarse, finish, plan, shares, solve};
use nestrad_tests::statistics::assert_within;
use proptest::prelude::*;

/// A small periodic canopy of two bands, a sun and a sky.
fn maize() -> Problem {
    let mut scenery = Scenery {
        problem: problem(&small_maize(), &par_and_nir(), Vec::new()),
    };
    scenery.problem.sources = uniform_sky(4, 2);
    scenery.source(from_zenith(40.0, 160.0), 400.0);
    scenery.problem
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
    let problem = maize();
    for estimator in ESTIMATORS {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().unwrap().install(|| {
                let mut plan = plan(
                    &problem,
                    &Settings {
                        estimator,
                        ..coarse()
                    },
                );
                if let Some(sampling) = &mut plan.sampling {
                    sampling.least_samples = sampling.least_samples.min(16.0);
                }
                finish(&problem, &plan).unwrap().solution
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
    let problem = maize();
    let plan = plan(&problem, &coarse());
    let mut sampling = plan.sampling.unwrap();
    sampling.batches = 2;
    let world = plan.world(&problem);
    let whole = BlockOf::whole(&world);
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
    let of = |blocks: &[BlockOf]| {
        trace_here(&problem.scene, &world, blocks, &sampling, || Ok(()))
            .unwrap()
            .halves
    };
    assert!(of(&[whole]) == of(&parts), "rows differ");
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_does_not() {
    let problem = maize();
    let with = |seed| {
        let settings = Settings { seed, ..coarse() };
        solve(&problem, &settings).solution
    };
    let first = with(1);
    assert!(first == with(1));
    assert!(first.organs != with(2).organs);
}

/// Direct light alone is sampled, too.
#[test]
fn another_seed_samples_a_black_canopy_elsewhere() {
    let mut problem = problem(
        &small_maize(),
        &[(LeafOptics::default(), 0.0)],
        uniform_sky(2, 1),
    );
    problem.bands[0].materials.fill(LeafOptics::default());
    let with = |seed| {
        let settings = Settings { seed, ..coarse() };
        solve(&problem, &settings).solution
    };
    assert!(with(1).organs != with(2).organs);
}

/// A mirrored canopy under mirrored light: with every triangle turned over to keep its upper face up.
#[test]
fn a_mirrored_scene_gets_the_same_light() {
    let problem = maize();
    let mirror = |v: DVec3| DVec3::new(-v.x, v.y, v.z);
    let mut mirrored = problem.clone();
    for [a, b, c] in &mut mirrored.scene.triangles {
        (*a, *b, *c) = (mirror(*a), mirror(*c), mirror(*b));
    }
    for source in &mut mirrored.sources {
        source.direction = mirror(source.direction);
    }
    // the pattern is centred on the origin
    let settings = coarse();
    let z = rms_z(
        &solve(&problem, &settings).solution,
        &solve(&mirrored, &settings).solution,
    );
    assert!(
        (0.5..1.4).contains(&z),
        "rms difference over its standard error: {z:.2}"
    );
}

/// Not in a single bit (`order`).
#[test]
fn the_order_of_triangles_means_nothing() {
    let problem = maize();
    let mut shuffled = problem.clone();
    let n = problem.scene.triangles.len();
    // a step without a common divisor goes through all of them
    let step = (n / 2 + 1..).find(|&s| gcd(s, n) == 1).unwrap();
    for (to, from) in (0..n).map(|k| (k, k * step % n)) {
        shuffled.scene.triangles[to] = problem.scene.triangles[from];
        shuffled.scene.organ[to] = problem.scene.organ[from];
        shuffled.scene.material[to] = problem.scene.material[from];
    }
    let settings = coarse();
    let a = solve(&problem, &settings).solution;
    let b = solve(&shuffled, &settings).solution;
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
    let problem = maize();
    let mut turned = problem.clone();
    let solid = |p: &Problem, t: usize| p.scene.material[t] == 0;
    for t in 0..turned.scene.triangles.len() {
        if !solid(&problem, t) {
            turned.scene.triangles[t].swap(1, 2);
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
    let a = solve(&problem, &settings).solution;
    let b = solve(&turned, &settings).solution;
    let largest = a.organs.iter().map(|i| i.absorbed_W).fold(0.0, f64::max);
    for (k, (a, b)) in a.organs.iter().zip(&b.organs).enumerate() {
        let stem = problem.scene.organs[k / 2].id.ends_with("000");
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
    let problem = maize();
    let (sun, sky) = problem.sources.split_last().unwrap();
    let with = |sources: Vec<_>| {
        let part = Problem {
            sources,
            sky_directions: 0,
            ..problem.clone()
        };
        solve(&part, &Settings::default()).solution
    };
    let both = with(problem.sources.clone());
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
    let problem = maize();
    let mut twice = problem.clone();
    for source in &mut twice.sources {
        source.irradiance_W_m2.iter_mut().for_each(|e| *e *= 2.0);
    }
    let settings = coarse();
    let once = solve(&problem, &settings).solution;
    let twice = solve(&twice, &settings).solution;
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
        let mut plan = plan(&scenery.problem, &coarse());
        (plan.max_edge_m, plan.direct_line_area_m2) = (0.1, 1e-4);
        if let Some(sampling) = &mut plan.sampling {
            sampling.line_area_m2 = 4e-4;
        }
        let solution = finish(&scenery.problem, &plan).unwrap().solution;
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
    let found = shares(&solve(&scenery.problem, &coarse()).solution, 0);
    assert_within(&format!("closure of {found:?}"), found.closure, 0.0, 0.005);
}
