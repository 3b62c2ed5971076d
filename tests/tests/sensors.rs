//! Sensors where their light is known in closed form, and that nothing else knows of them.

#![allow(clippy::unwrap_used)]

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use nestrad_common::light::{Radiance, SkyLight};
use nestrad_common::optics::LeafOptics;
use nestrad_common::options::{Diameter, Scatter};
use nestrad_common::sensors::{DEFAULT_RAYS, Receives, Sensor, Shape};
use nestrad_engine::plan::Settings;
use nestrad_engine::solution::{SensorLight, Solution};
use nestrad_tests::adding::{plates, stack};
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{coarse, solve};
use nestrad_tests::statistics::assert_within;

fn sensor(shape: Shape, receives: Receives) -> Sensor {
    Sensor {
        name: "s".to_owned(),
        shape,
        receives,
        rays: DEFAULT_RAYS,
    }
}

fn facing(at: DVec3, facing: DVec3) -> Sensor {
    let receives = Receives::Side {
        facing,
        lower: facing.z < 0.0,
    };
    sensor(Shape::Point(at), receives)
}

fn sphere(at: DVec3) -> Sensor {
    sensor(Shape::Point(at), Receives::Everywhere)
}

fn looking(at: DVec3, from: DVec3) -> Sensor {
    sensor(Shape::Point(at), Receives::From(from.normalize()))
}

fn uniform_sky(bands: usize, horizontal: f64) -> SkyLight {
    SkyLight {
        radiance: Radiance::Uniform,
        irradiance_W_m2: vec![horizontal; bands],
        diffuse_fraction: 1.0,
    }
}

/// What all sensors of a scene read in its first band.
fn read(scenery: &Scenery, settings: &Settings) -> Vec<SensorLight> {
    let solution = solve(&scenery.scene(), settings).solution;
    assert_eq!(solution.readings.len(), scenery.sensors.len());
    solution
        .readings
        .iter()
        .map(|reading| reading.light[0])
        .collect()
}

/// Within so many parts of what is expected.
#[track_caller]
fn assert_reads(what: &str, found: f64, expected: f64, part: f64) {
    assert_within(what, found, expected, part * expected.abs() + 1e-9);
}

/// A speck leaves the ground as good as bare.
fn bare_ground(pattern: bool) -> Scenery {
    let mut scenery = if pattern {
        Scenery::periodic(DVec2::splat(1.0))
    } else {
        Scenery::open()
    }
    .soil(0.0);
    scenery.level("speck", DVec3::new(0.5, 0.5, 0.02), DVec2::splat(0.02));
    scenery.band("B", 0.3, &[]);
    scenery
}

#[test]
fn on_bare_ground_there_is_the_irradiance_above_and_what_the_soil_sends_back() {
    for pattern in [false, true] {
        let mut scenery = bare_ground(pattern);
        scenery.source(from_zenith(50.0, 130.0), 400.0);
        scenery.sky = Some(uniform_sky(1, 100.0));
        let at = DVec3::new(0.2, 0.3, 0.4);
        scenery.sensors = vec![
            facing(at, DVec3::Z),
            facing(at, -DVec3::Z),
            // on the ground
            facing(DVec3::new(0.7, 0.2, 0.0), DVec3::Z),
            facing(DVec3::new(0.7, 0.2, 0.0), -DVec3::Z),
            // half sky, half ground, and no sun
            facing(at, DVec3::new(1.0, 0.0, 0.0)),
            sphere(at),
            looking(at, DVec3::new(0.3, 0.2, 0.1)),
            looking(at, -DVec3::Z),
        ];
        let read = read(&scenery, &coarse());
        let (sun, sky, back) = (400.0, 100.0, 0.3 * 500.0);
        let cosine = 50f64.to_radians().cos();
        for k in [0, 2] {
            assert_reads("upper", read[k].direct.value, sun + sky, 2e-3);
            assert_reads("upper", read[k].scattered.value, 0.0, 0.0);
        }
        for k in [1, 3] {
            assert_reads("lower", read[k].direct.value, 0.0, 0.0);
            let scattered = read[k].scattered;
            let bound = (4.0 * scattered.se.hypot(read[k].bias)).max(2e-3 * back);
            assert!(bound < 0.25 * back, "{scattered:?}");
            assert_within("lower", scattered.value, back, bound);
        }
        assert_reads("wall, sky", read[4].direct.value, sky / 2.0, 0.02);
        assert_reads("wall, ground", read[4].scattered.value, back / 2.0, 0.01);
        // a uniform sky of radiance L has an irradiance of pi L, and a scalar one of 2 pi L
        let scalar = sun / cosine + 2.0 * sky;
        assert_reads("sphere", read[5].direct.value, scalar, 3e-3);
        assert_reads("sphere, ground", read[5].scattered.value, 2.0 * back, 5e-3);
        assert_reads("radiance of the sky", read[6].direct.value, sky / PI, 1e-9);
        assert_eq!((read[6].scattered.value, read[7].direct.value), (0.0, 0.0));
        // on the ground, looking down, there is one cell of the soil
        for light in [0, 1, 2, 4, 5].map(|k| read[k]) {
            assert!(light.total().se <= 0.02 * light.total().value, "{light:?}");
        }
    }
}

/// Stacks of full plates, by the adding of layers; and where a sensor lies in a plate it sees past it.
#[test]
fn between_plates_there_is_what_the_adding_of_layers_says() {
    let (leaf, albedo) = (LeafOptics::symmetric(0.3, 0.4), 0.2);
    let mut scenery = plates(3, 0.1, leaf, albedo);
    let expected = stack(3, leaf, albedo);
    let heights = (0..3).map(|k| {
        let of_plate = scenery.triangles.iter().find(|t| t.organ == k);
        of_plate.unwrap().corners_m[0].z
    });
    let heights: Vec<f64> = heights.collect();
    for (k, &z) in heights.iter().enumerate() {
        for dz in [0.0, 0.03] {
            let at = DVec3::new(0.31, 0.17, z);
            scenery.sensors.push(facing(at + dz * DVec3::Z, DVec3::Z));
            scenery.sensors.push(facing(at - dz * DVec3::Z, -DVec3::Z));
        }
        assert!(k == 0 || z < heights[k - 1], "from the top down");
    }
    let nested = Settings {
        diameter: Diameter::Metres(0.05),
        ..coarse()
    };
    for settings in [coarse(), nested] {
        let read = read(&scenery, &settings);
        for k in 0..3 {
            for pair in 0..2 {
                let [upper, lower] = [0, 1].map(|side| read[4 * k + 2 * pair + side].total());
                let what = format!("plate {k}, {pair}");
                assert_reads(&what, upper.value, 100.0 * expected.upper[k], 0.01);
                assert_reads(&what, lower.value, 100.0 * expected.lower[k], 0.01);
            }
        }
    }
}

/// Under a sheet that lets a part through, over black soil: the sheet's lower face is all that it sees.
#[test]
fn under_a_translucent_sheet_there_is_what_it_lets_through() {
    let mut scenery = Scenery::periodic(DVec2::splat(0.5)).soil(0.0);
    scenery.level("sheet", DVec3::new(0.0, 0.0, 1.0), DVec2::splat(0.5));
    scenery.band("B", 0.0, &[("sheet", LeafOptics::symmetric(0.2, 0.6))]);
    scenery.source(from_zenith(30.0, 0.0), 300.0);
    let at = DVec3::new(0.1, 0.2, 0.5);
    scenery.sensors = vec![
        facing(at, DVec3::Z),
        facing(at, -DVec3::Z),
        sphere(at),
        looking(at, DVec3::new(0.3, 0.1, 0.4)),
        looking(at, -DVec3::Z),
        looking(at + DVec3::Z, -DVec3::Z),
    ];
    let read = read(&scenery, &coarse());
    let through = 0.6 * 300.0;
    for (k, expected) in [
        (0, through),
        (1, 0.0),
        (2, 2.0 * through),
        (3, through / PI),
        (4, 0.0),
        (5, 0.2 * 300.0 / PI),
    ] {
        assert_eq!(read[k].direct.value, 0.0);
        assert_reads(&format!("{k}"), read[k].scattered.value, expected, 2e-3);
    }
}

/// Black walls without end, `gap` apart and `height` high: the floor in the middle sees a strip of the sky, of which it
/// gets the sine of half its angle.
#[test]
fn between_furrows_there_is_a_strip_of_the_sky() {
    let (gap, height) = (0.6, 0.4);
    let mut scenery = Scenery::periodic(DVec2::new(gap, 0.5)).soil(0.0);
    let wall = [(0.0, 0.0), (0.5, 0.0), (0.5, height), (0.0, height)];
    scenery.quad("wall", wall.map(|(y, z)| DVec3::new(0.0, y, z)));
    scenery.band("B", 0.0, &[]);
    scenery.sky = Some(uniform_sky(1, 200.0));
    for (x, z) in [(0.5 * gap, 0.0), (0.25 * gap, 0.1)] {
        scenery
            .sensors
            .push(facing(DVec3::new(x, 0.2, z), DVec3::Z));
    }
    // the mean over the floor: Hottel's crossed strings
    let corner = DVec3::new(0.0, 0.1, 0.0);
    let edges = [DVec3::X * gap, DVec3::Y * 0.2];
    let up = Receives::Side {
        facing: DVec3::Z,
        lower: false,
    };
    scenery
        .sensors
        .push(sensor(Shape::Parallelogram(corner, edges), up));
    let read = read(&scenery, &coarse());
    let sine = |x: f64, up: f64| x / x.hypot(up);
    let strings = (gap.hypot(height) - height) / gap;
    for (light, expected) in read.iter().zip([
        sine(0.5 * gap, height),
        0.5 * (sine(0.25 * gap, height - 0.1) + sine(0.75 * gap, height - 0.1)),
        strings,
    ]) {
        let (found, expected) = (light.direct, 200.0 * expected);
        let stated = found.se.hypot(light.bias);
        assert!(stated <= 0.03 * expected, "{light:?}");
        assert_within("sky", found.value, expected, 4.0 * stated);
        assert_reads("sky", found.value, expected, 0.03);
        assert_eq!(light.scattered.value, 0.0);
    }
}

/// A white wall beside a sensor: its radiance from the side is that of the wall, whichever way it looks at it.
#[test]
fn from_the_side_a_wall_has_its_radiosity_over_pi() {
    let mut scenery = Scenery::open();
    let wall = [(-1.0, 0.0), (1.0, 0.0), (1.0, 2.0), (-1.0, 2.0)];
    scenery.quad("wall", wall.map(|(y, z)| DVec3::new(0.0, y, z)));
    scenery.band("R", 0.0, &[("wall", LeafOptics::opaque(0.05))]);
    scenery.band("FR", 0.0, &[("wall", LeafOptics::opaque(0.5))]);
    scenery.source(DVec3::new(-1.0, 0.0, -1.0), 100.0);
    let at = DVec3::new(0.5, 0.1, 1.0);
    scenery.sensors = vec![
        looking(at, DVec3::new(-1.0, 0.0, 0.0)),
        looking(at, DVec3::new(-1.0, 0.5, 0.3)),
        looking(at, DVec3::X),
        facing(at, -DVec3::X),
    ];
    let solution = solve(&scenery.scene(), &coarse()).solution;
    let of = |k: usize, b: usize| solution.readings[k].light[b].scattered.value;
    for (b, rho) in [(0, 0.05), (1, 0.5)] {
        for k in 0..2 {
            assert_reads("wall", of(k, b), rho * 100.0 / PI, 0.01);
        }
        assert_eq!(of(2, b), 0.0);
    }
    // form factor of a rectangle from a point: four quarters (Howell, C-3)
    let quarter = |a: f64, b: f64| {
        let (a, b) = (a / 0.5, b / 0.5);
        let (p, q) = (a.hypot(1.0), b.hypot(1.0));
        (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * PI)
    };
    let seen = 2.0 * (quarter(1.1, 1.0) + quarter(0.9, 1.0));
    assert_reads("irradiance of the wall", of(3, 1), 50.0 * seen, 0.01);
}

/// Sunlit parts of a patch under a leaf, and the scatter of its points over what is stated.
#[test]
fn the_mean_over_a_patch_counts_its_sunlit_part() {
    let mut scenery = Scenery::open().soil(0.0);
    scenery.level("leaf", DVec3::new(0.0, 0.0, 0.5), DVec2::splat(0.3));
    scenery.band("B", 0.0, &[]);
    scenery.source(DVec3::NEG_Z, 100.0);
    let up = Receives::Side {
        facing: DVec3::Z,
        lower: false,
    };
    let corner = DVec3::new(0.1, 0.1, 0.2);
    let edges = [DVec3::X * 0.6, DVec3::Y * 0.4];
    scenery.sensors = vec![
        sensor(Shape::Parallelogram(corner, edges), up),
        sensor(Shape::Triangle(corner, edges), up),
    ];
    let read = read(&scenery, &coarse());
    // 0.2 x 0.2 of 0.6 x 0.4, and all of that within the triangle
    for (light, shaded) in read.iter().zip([0.04 / 0.24, 0.04 / 0.12]) {
        assert_reads("patch", light.direct.value, 100.0 * (1.0 - shaded), 0.01);
        assert!(light.direct.se < 1.0 && light.direct.se > 0.0, "{light:?}");
        assert_within(
            "patch",
            light.direct.value,
            100.0 * (1.0 - shaded),
            4.0 * light.direct.se,
        );
    }
}

fn some_leaves(pattern: bool) -> Scenery {
    let mut scenery = if pattern {
        Scenery::periodic(DVec2::splat(0.8))
    } else {
        Scenery::open()
    }
    .soil(-0.01);
    for k in 0..8 {
        let x = 0.1 * f64::from(k);
        let at = DVec3::new(x, (0.37 * f64::from(k)).fract() * 0.6, 0.05 + 0.06 * x);
        scenery.level(&format!("leaf {k}"), at, DVec2::splat(0.2));
    }
    scenery.band("PAR", 0.15, &[("leaf", LeafOptics::symmetric(0.1, 0.05))]);
    scenery.band("NIR", 0.25, &[("leaf", LeafOptics::symmetric(0.45, 0.4))]);
    scenery.source(from_zenith(40.0, 70.0), 300.0);
    scenery.sky = Some(uniform_sky(2, 150.0));
    scenery
}

fn with_sensors(mut scenery: Scenery) -> Scenery {
    for k in 0..12 {
        let at = DVec3::new(0.07 * f64::from(k), 0.3, 0.03 + 0.02 * f64::from(k % 5));
        scenery.sensors.push(facing(at, DVec3::Z));
        scenery.sensors.push(facing(at, -DVec3::Z));
        scenery.sensors.push(sphere(at));
        scenery
            .sensors
            .push(looking(at, DVec3::new(1.0, 0.2, -0.1)));
    }
    scenery
}

fn without_readings(solution: Solution) -> Solution {
    Solution {
        readings: Vec::new(),
        ..solution
    }
}

#[test]
fn nothing_else_knows_of_them() {
    for pattern in [false, true] {
        for settings in [
            coarse(),
            Settings {
                diameter: Diameter::Metres(0.2),
                ..coarse()
            },
            Settings {
                scatter: Scatter::None,
                ..coarse()
            },
        ] {
            let alone = solve(&some_leaves(pattern).scene(), &settings).solution;
            let with = solve(&with_sensors(some_leaves(pattern)).scene(), &settings).solution;
            assert_eq!(with.readings.len(), 48);
            assert!(alone == without_readings(with), "{settings:?}");
        }
    }
}

#[test]
fn threads_change_no_bit_and_a_sensor_reads_the_same_wherever_the_pattern_is_entered() {
    let scene = with_sensors(some_leaves(true)).scene();
    let by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| solve(&scene, &coarse()).solution)
    };
    assert!(by(1) == by(3));

    let mut scenery = some_leaves(true);
    let at = DVec3::new(0.31, 0.22, 0.08);
    let away = DVec3::new(3.0 * 0.8, -2.0 * 0.8, 0.0);
    scenery.sensors = vec![facing(at, DVec3::Z), facing(at + away, DVec3::Z)];
    let read = read(&scenery, &coarse());
    assert_reads("away", read[1].direct.value, read[0].direct.value, 1e-9);
    let bound = 5.0 * read[0].scattered.se.hypot(read[1].scattered.se);
    assert_within(
        "away",
        read[1].scattered.value,
        read[0].scattered.value,
        bound,
    );
}

/// First order: what reaches a sensor by a leaf is not followed.
#[test]
fn without_scattered_light_they_read_direct_light_alone() {
    let first = Settings {
        scatter: Scatter::None,
        ..coarse()
    };
    let scenery = with_sensors(some_leaves(true));
    let (all, none) = (read(&scenery, &coarse()), read(&scenery, &first));
    for (all, none) in all.iter().zip(&none) {
        assert_eq!(all.direct.value, none.direct.value);
        assert_eq!(none.scattered.value, 0.0);
    }
    assert!(all.iter().any(|light| light.scattered.value > 1.0));
}

/// Over seeds, what is stated of the rays is what they scatter by.
#[test]
fn stated_errors_are_those_that_there_are() {
    let scenery = with_sensors(some_leaves(true));
    let sensors = scenery.sensors.len();
    let runs: Vec<Vec<[f64; 2]>> = (1..=16)
        .map(|seed| {
            let settings = Settings { seed, ..coarse() };
            let solution = solve(&scenery.scene(), &settings).solution;
            let of = |reading: &nestrad_engine::solution::Reading| {
                let scattered = reading.light[1].scattered;
                [scattered.value, scattered.se]
            };
            solution.readings.iter().map(of).collect()
        })
        .collect();
    let (mut off, mut stated, mut whole) = (0.0, 0.0, 0.0);
    for k in (0..sensors).filter(|k| k % 4 < 3) {
        let mean = runs.iter().map(|run| run[k][0]).sum::<f64>() / 16.0;
        for run in &runs {
            off += (run[k][0] - mean).powi(2) * 16.0 / 15.0;
            stated += run[k][1].powi(2);
            whole += run[k][0].powi(2);
        }
    }
    let ratio = (off / stated).sqrt();
    let percent = 100.0 * (off / whole).sqrt();
    assert!((0.6..1.4).contains(&ratio), "{ratio}, {percent} %");
    assert!(percent < 1.0, "{percent} %");
}
