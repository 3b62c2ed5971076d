//! Published fluxes of an open forest (RAMI4PILPS; Widlowski et al. 2011, doi:10.1029/2010JG001511): spherical
//! crowns of 5 m radius, 7 to 10 m high at their middle, each of 12,500 discs of 0.1 m radius in all directions,
//! on soils from black to snow, under a direct beam. Where the crowns stand was not published: on a smaller plot
//! of the same leaf area they are drawn at random, so that no two overlap.

#![allow(clippy::unwrap_used, non_snake_case)]
#![allow(
    clippy::print_stderr,
    reason = "the figures are kept in the documentation"
)]

use std::f64::consts::{PI, TAU};
use std::fs;

use glam::{DVec2, DVec3};
use nestrad_common::light::Source;
use nestrad_common::optics::LeafOptics;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_tests::random::Dice;
use nestrad_tests::reference::shared;
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{shares, solve};

const CROWNS: usize = 16;
const CROWN_RADIUS_M: f64 = 5.0;
const DISCS: usize = 12_500;
const DISC_RADIUS_M: f64 = 0.1;

/// A case of the table; fluxes as fractions of the beam.
struct Published {
    name: String,
    soil_albedo: f64,
    leaf: LeafOptics,
    zenith_deg: f64,
    absorbed: f64,
    reflected: f64,
    downward_at_ground: f64,
    leaf_area_index: f64,
}

fn published(table: &str) -> Vec<Published> {
    let of = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |k: usize| -> f64 { cells[k].parse().unwrap() };
        Published {
            name: format!("{} {} {}", cells[0], cells[3], cells[7]),
            leaf_area_index: number(1),
            soil_albedo: number(4),
            leaf: LeafOptics::symmetric(number(5), number(6)),
            zenith_deg: number(7),
            absorbed: number(8),
            reflected: number(9),
            downward_at_ground: number(10),
        }
    };
    table.lines().skip(1).map(of).collect()
}

/// Somewhere on a sphere.
fn direction(dice: &mut Dice) -> DVec3 {
    let (z, azimuth) = (2.0 * dice.unit() - 1.0, TAU * dice.unit());
    let r = (1.0f64 - z * z).sqrt();
    DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
}

fn crowns(dice: &mut Dice, side_m: f64) -> Vec<DVec3> {
    let apart = |a: DVec3, b: DVec3| {
        let d = (a - b).truncate();
        let d = d - side_m * (d / side_m).round();
        d.extend(a.z - b.z).length() >= 2.0 * CROWN_RADIUS_M
    };
    let mut middles: Vec<DVec3> = Vec::new();
    while middles.len() < CROWNS {
        let new = DVec3::new(
            side_m * dice.unit(),
            side_m * dice.unit(),
            7.0 + 3.0 * dice.unit(),
        );
        if middles.iter().all(|&known| apart(known, new)) {
            middles.push(new);
        }
    }
    middles
}

/// Squares stand for discs of the same area.
fn forest(leaf_area_index: f64, seed: u64) -> Scenery {
    let dice = &mut Dice(seed);
    let disc_m2 = PI * DISC_RADIUS_M * DISC_RADIUS_M;
    let side_m = ((CROWNS * DISCS) as f64 * disc_m2 / leaf_area_index).sqrt();
    let mut forest = Scenery::periodic(DVec2::splat(side_m)).soil(0.0);
    for (crown, middle) in crowns(dice, side_m).into_iter().enumerate() {
        let organ = format!("leaf {crown}");
        for _ in 0..DISCS {
            let within = (CROWN_RADIUS_M - DISC_RADIUS_M) * dice.unit().cbrt();
            let at = middle + within * direction(dice);
            let normal = direction(dice);
            let half_m = 0.5 * disc_m2.sqrt();
            let (x, y) = normal.any_orthonormal_pair();
            let (x, y) = (half_m * x, half_m * y);
            forest.quad(&organ, [at - x - y, at + x - y, at + x + y, at - x + y]);
        }
    }
    forest
}

/// All cases at once: a band each, with a beam of its own.
fn scene(cases: &[Published], seed: u64) -> Scene {
    let mut forest = forest(cases[0].leaf_area_index, seed);
    for case in cases {
        forest.band(&case.name, case.soil_albedo, &[("leaf", case.leaf)]);
    }
    for (k, case) in cases.iter().enumerate() {
        let mut irradiance_W_m2 = vec![0.0; cases.len()];
        irradiance_W_m2[k] = 1000.0;
        forest.sources.push(Source {
            direction: from_zenith(case.zenith_deg, 30.0),
            irradiance_W_m2,
        });
    }
    forest.scene()
}

#[test]
fn the_open_forest_has_its_published_fluxes() {
    let Some(folder) = shared() else { return };
    let table = fs::read_to_string(folder.join("reference/rami4pilps_open_forest.csv")).unwrap();
    let cases = published(&table);
    let settings = Settings {
        accuracy_percent: 5.0,
        ..Settings::default()
    };
    let solution = solve(&scene(&cases, 1), &settings).solution;
    let mut off = Vec::new();
    eprintln!("case: absorbed, reflected, downward at the ground, less what is published");
    for (band, case) in cases.iter().enumerate() {
        let shares = shares(&solution, band);
        let apart = [
            shares.plants - case.absorbed,
            shares.up - case.reflected,
            shares.soil / (1.0 - case.soil_albedo) - case.downward_at_ground,
        ];
        let [a, b, c] = apart;
        eprintln!("{}: {a:+.4} {b:+.4} {c:+.4}", case.name);
        if apart.iter().any(|part| part.abs() > 0.015) {
            off.push(case.name.as_str());
        }
    }
    assert!(!cases.is_empty() && off.is_empty(), "{off:?}");
}
