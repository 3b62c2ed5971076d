//! Faces that stand twice: between faces in one plane all is dark but for what passes through them, whichever side
//! lines and rays come from.

#![allow(clippy::unwrap_used)]
#![allow(clippy::print_stderr, reason = "the figures are worth reading")]

use std::fs;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use nestrad_common::assemble::{load, load_scene_file};
use nestrad_common::canopy::{Canopy, Mesh, Triangle};
use nestrad_common::generate::{Bean, LeafAngles, Stand};
use nestrad_common::optics::LeafOptics;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_engine::solution::{ItemLight, Solution};
use nestrad_tests::canopies::{
    par_and_nir, scenery as canopy, small_leaves, small_maize, uniform_sky,
};
use nestrad_tests::random::Dice;
use nestrad_tests::reference::{sample, shared};
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{ESTIMATORS, by, coarse, finish, plan, solve};
use nestrad_tests::statistics::assert_close;

/// How the second face is made of the first.
#[derive(Clone, Copy, Debug)]
enum Twin {
    Same,
    FromAnotherCorner,
    TurnedOver,
    AHairAway,
    ARoundingAway,
    Part,
    PartTurnedOver,
}

const TWINS: [Twin; 7] = [
    Twin::Same,
    Twin::FromAnotherCorner,
    Twin::TurnedOver,
    Twin::AHairAway,
    Twin::ARoundingAway,
    Twin::Part,
    Twin::PartTurnedOver,
];

fn twin(how: Twin, [a, b, c]: [DVec3; 3]) -> [DVec3; 3] {
    let normal = (b - a).cross(c - a).normalize();
    let within = |s: f64, t: f64| a + s * (b - a) + t * (c - a);
    match how {
        Twin::Same => [a, b, c],
        Twin::FromAnotherCorner => [b, c, a],
        Twin::TurnedOver => [a, c, b],
        Twin::AHairAway => [a, b, c].map(|v| v - 1e-9 * normal),
        Twin::ARoundingAway => [a, b, c].map(|v| v * (1.0 + f64::EPSILON)),
        Twin::Part => [within(0.1, 0.2), within(0.6, 0.1), within(0.2, 0.55)],
        Twin::PartTurnedOver => [within(0.1, 0.2), within(0.2, 0.55), within(0.6, 0.1)],
    }
}

/// What leaves the upper and the lower face, W m⁻².
fn sent(of: &ItemLight, optics: &LeafOptics) -> [f64; 2] {
    let (up, down) = (of.irradiance_upper_W_m2, of.irradiance_lower_W_m2);
    [
        optics.upper.rho * up + optics.lower.tau * down,
        optics.lower.rho * down + optics.upper.tau * up,
    ]
}

/// By how much the light on the inner face of the second triangle differs from what the face before it sends, in parts of
/// what is on its outer face: for the order of the two that suits best.
fn leak(solution: &Solution, optics: [&LeafOptics; 2], turned_over: bool) -> f64 {
    let [first, second] = [&solution.triangles[0], &solution.triangles[1]];
    let from = sent(first, optics[0]);
    let on = [second.irradiance_upper_W_m2, second.irradiance_lower_W_m2];
    let brightest = on[0].max(on[1]);
    (0..2)
        .map(|inner: usize| {
            // an upper face looks at a lower one, unless one of the two is turned over
            let before = if turned_over { inner } else { 1 - inner };
            (on[inner] - from[before]).abs() / brightest
        })
        .fold(f64::INFINITY, f64::min)
}

/// A leaf in the open, over a reflecting soil, of all inclinations, with a twin: the inner face of the twin gets what the
/// leaf sends there and nothing else.
#[test]
fn between_coincident_faces_is_no_light_but_what_passes_through_them() {
    let mut dice = Dice(17);
    for k in 0..12 {
        for how in TWINS {
            let mut scenery = Scenery::periodic(DVec2::splat(0.6)).soil(0.0);
            let mut at = |x: f64| DVec3::new(dice.unit(), dice.unit(), dice.unit()) * 0.25 + x;
            let mut leaf = [at(0.2), at(0.2), at(0.2)];
            if k % 6 == 0 {
                // upright, as stems are
                leaf[2] = leaf[0].with_z(leaf[2].z);
            }
            let size = (leaf[1] - leaf[0]).cross(leaf[2] - leaf[0]).length();
            if size < 4e-3 {
                continue;
            }
            scenery.triangle("leaf", leaf);
            scenery.triangle("other", twin(how, leaf));
            let [one, two] = [dice.leaf(), dice.leaf()];
            scenery.band("B", 0.5, &[("leaf", one), ("other", two)]);
            scenery.source(from_zenith(35.0, 200.0), 100.0);
            scenery.source(from_zenith(70.0, 20.0), 100.0);
            let scene = scenery.scene();
            for estimator in ESTIMATORS {
                let mut plan = plan(&scene, &by(estimator));
                plan.trace.max_edge_m = 1.0;
                plan.light.tolerance.absorbed = 1e-10;
                let solution = finish(&scene, &plan).unwrap().solution;
                let turned_over = matches!(how, Twin::TurnedOver | Twin::PartTurnedOver);
                let leak = leak(&solution, [&one, &two], turned_over);
                assert!(leak < 1e-7, "leaf {k}, {how:?}, {estimator:?}: {leak:.1e}");
            }
        }
    }
}

/// The scene with opaque leaves, and the same with a third of all organs twice, in three ways: nothing passes through, so
/// what stands twice is the same as what stands once.
fn once_and_twice(scene: &Scene) -> [Scene; 2] {
    let mut optics = (*scene.optics).clone();
    for leaf in optics.bands.iter_mut().flat_map(|band| &mut band.materials) {
        (leaf.upper.tau, leaf.lower.tau) = (0.0, 0.0);
        leaf.lower.rho = leaf.upper.rho;
    }
    let twins = scene.canopy.triangles().filter_map(|triangle| {
        let how = match triangle.organ % 9 {
            0 => Twin::Same,
            3 => Twin::TurnedOver,
            6 => Twin::AHairAway,
            _ => return None,
        };
        let corners_m = twin(how, triangle.corners_m);
        Some(Triangle {
            corners_m,
            ..triangle
        })
    });
    let mesh: Mesh = scene.canopy.triangles().chain(twins).collect();
    assert!(5 * (mesh.len() - scene.canopy.len()) > scene.canopy.len());
    let mut twice = Canopy::of_meshes(vec![mesh]);
    twice.organs.clone_from(&scene.canopy.organs);
    twice.materials.clone_from(&scene.canopy.materials);
    twice.declared.clone_from(&scene.canopy.declared);
    (twice.pattern, twice.soil_z_m) = (scene.canopy.pattern, scene.canopy.soil_z_m);
    twice.origin_m = scene.canopy.origin_m;
    let optics = Arc::new(optics);
    [scene.canopy.clone(), Arc::new(twice)].map(|canopy| Scene {
        canopy,
        optics: optics.clone(),
        light: scene.light.clone(),
        sensors: Arc::default(),
    })
}

#[track_caller]
fn agree(name: &str, a: &Solution, b: &Solution) {
    let (mut beyond, mut square) = (0, 0.0);
    for (x, y) in a.organs.iter().zip(&b.organs) {
        let se = x.absorbed_se_W.hypot(y.absorbed_se_W);
        let z = (x.absorbed_W - y.absorbed_W) / se.max(f64::MIN_POSITIVE);
        square += z * z;
        beyond += usize::from(z.abs() > 3.0);
    }
    let rms = (square / a.organs.len() as f64).sqrt();
    eprintln!(
        "{name}: rms {rms:.2}, {beyond} of {} beyond 3",
        a.organs.len()
    );
    assert!(
        rms < 1.3 && 50 * beyond <= a.organs.len(),
        "{name}: {rms}, {beyond}"
    );
    for (x, y) in a.balance.iter().zip(&b.balance) {
        let [x, y] = [x, y].map(|balance| balance.absorbed_plants_W);
        let se = x.se.hypot(y.se);
        assert_close(name, y.value, x.value, se, 3.0, 0.01 * x.value);
    }
}

/// Organs absorb, both faces together, what they absorb alone, and lines and rays agree.
#[test]
fn a_canopy_whose_organs_stand_twice_absorbs_what_it_absorbs_alone() {
    let bean = Bean {
        stand: Stand {
            rows: 1,
            plants_per_row: 1,
            row_spacing_m: 0.4,
            plant_spacing_m: 0.3,
        },
        leaf_triangle_m2: 2e-4,
        seed: 3,
    };
    let canopies = [
        ("maize", small_maize()),
        ("bean", bean.generate().unwrap()),
        ("leaves", small_leaves(2.0, LeafAngles::Spherical, 0.01, 4)),
    ];
    for (name, generated) in canopies {
        let scene = canopy(&generated, &par_and_nir(), uniform_sky(8, 2)).scene();
        let [alone, twice] = once_and_twice(&scene);
        let solved = ESTIMATORS.map(|estimator| {
            let settings = Settings {
                estimator,
                ..coarse()
            };
            let [a, b] = [&alone, &twice].map(|scene| solve(scene, &settings).solution);
            agree(&format!("{name}, {estimator:?}"), &a, &b);
            b
        });
        let [lines, rays] = &solved;
        for (l, r) in lines.balance.iter().zip(&rays.balance) {
            let [l, r] = [l, r].map(|balance| balance.absorbed_plants_W);
            assert_close(
                name,
                l.value,
                r.value,
                l.se.hypot(r.se),
                3.0,
                0.01 * l.value,
            );
        }
    }
}

#[test]
fn sample_scenes_whose_organs_stand_twice_absorb_what_they_absorb_alone() {
    let Some(folder) = shared() else { return };
    for name in ["maize_rows", "bean_rows", "rice_hills"] {
        let [alone, twice] = once_and_twice(&sample(&folder, name, -0.002));
        let [a, b] = [&alone, &twice].map(|scene| solve(scene, &coarse()).solution);
        agree(name, &a, &b);
    }
}

/// Two closed-off faces of two stems, one of which looks at the other: they got half of the light.
#[test]
fn stems_that_stand_twice_are_dark_where_they_touch() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    file(
        "scene.can",
        "p 1 100001000001 3 0.1 0.1 0.5 0.106 0.103 0.506 0.101 0.106 0.502\n\
         p 1 100001000002 3 0.1 0.1 0.5 0.106 0.103 0.506 0.101 0.106 0.502\n\
         p 1 100001001001 3 0.0 0.0 0.6 0.1 0.0 0.62 0.08 0.1 0.6\n\
         p 1 100001001002 3 0.0 0.0 0.3 0.25 0.0 0.32 0.08 0.2 0.3\n",
    );
    file("band.opt", "n 1\ns d 0\ne d 0.5 d 0.4 0.4 d 0.4 0.4\n");
    file("sun.light", "100 0.3 0.2 -0.9\n");
    file(
        "scene.toml",
        "scene = \"scene.can\"\npattern = [0, 0, 0.3, 0.3]\nsoil = 0\nlight = \"sun.light\"\n\
         [[bands]]\nname = \"B\"\noptics = \"band.opt\"\n",
    );
    let inputs = load_scene_file(&folder.path().join("scene.toml")).unwrap();
    let scene = load(&inputs).unwrap().scene;
    for estimator in ESTIMATORS {
        let solution = solve(&scene, &by(estimator)).solution;
        let [a, b] = [&solution.triangles[0], &solution.triangles[1]];
        // of two faces that look the same way, the upper one of one and the lower one of the other are outside
        let dark = [
            a.irradiance_lower_W_m2.max(b.irradiance_upper_W_m2),
            b.irradiance_lower_W_m2.max(a.irradiance_upper_W_m2),
        ];
        assert_eq!(dark[0].min(dark[1]), 0.0, "{estimator:?}: {dark:?}");
        assert!(dark[0].max(dark[1]) > 2.0, "{estimator:?}: {dark:?}");
    }
}

/// Many faces in one place, and settings as they are by default.
#[test]
fn of_a_stack_only_the_outer_faces_are_lit() {
    let mut scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
    let leaf = [
        DVec3::new(0.1, 0.1, 0.5),
        DVec3::new(0.6, 0.3, 0.7),
        DVec3::new(0.3, 0.7, 0.4),
    ];
    for k in 0..5 {
        let how = TWINS[k % 3];
        scenery.triangle(&format!("leaf {k}"), twin(how, leaf));
    }
    let optics = LeafOptics::symmetric(0.5, 0.0);
    scenery.band("B", 0.5, &[("leaf", optics)]);
    scenery.source(from_zenith(50.0, 250.0), 100.0);
    let scene = scenery.scene();
    for estimator in ESTIMATORS {
        let solution = solve(&scene, &by(estimator)).solution;
        let faces = solution
            .triangles
            .iter()
            .flat_map(|t| [t.irradiance_upper_W_m2, t.irradiance_lower_W_m2]);
        let lit = faces.filter(|&e| e > 0.0).count();
        assert_eq!(lit, 2, "{estimator:?}");
    }
}
