//! What light counts as: leaves, stems, structures and soil, and no more than what comes in.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use nestrad_common::canopy::{Kind, Material};
use nestrad_common::optics::LeafOptics;
use nestrad_common::scene::Scene;
use nestrad_engine::solution::{Balance, Estimate, Solution};
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{coarse, solve};

/// A panel above half of a crop, a film on a quarter of its soil, a leaf and a stem.
fn tunnel(optics: &[(&str, LeafOptics)], soil_albedo: f64) -> Scenery {
    let mut scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
    let strip = |x: f64, width: f64, z: f64| (DVec3::new(x, 0.0, z), DVec2::new(width, 1.0));
    for (organ, (min, size)) in [
        ("panel", strip(0.0, 0.5, 2.0)),
        ("film", strip(0.5, 0.25, 0.01)),
        ("leaf", strip(0.75, 0.125, 0.6)),
        ("stem", strip(0.875, 0.0625, 0.5)),
    ] {
        scenery.level(organ, min, size);
    }
    scenery.band("PAR", soil_albedo, optics);
    scenery
}

/// The scene with kinds declared.
fn declared(scenery: &Scenery, kinds: &[(&str, Kind)]) -> Scene {
    let mut scene = scenery.scene();
    let kinds = kinds
        .iter()
        .map(|&(name, kind)| (Material::Named(name.to_owned()), kind));
    Arc::make_mut(&mut scene.canopy).declared = kinds.collect::<BTreeMap<_, _>>();
    scene
}

const KINDS: [(&str, Kind); 3] = [
    ("panel", Kind::Structure),
    ("film", Kind::Structure),
    ("stem", Kind::Stem),
];

fn balance(scene: &Scene) -> (Solution, Balance) {
    let solution = solve(scene, &coarse()).solution;
    let balance = solution.balance[0].clone();
    (solution, balance)
}

fn near(found: Estimate, expected: f64) {
    // a row of the lattice along an edge of the panel has 0.8 W
    assert!(
        (found.value - expected).abs() < 1.0,
        "{found:?}, {expected}"
    );
}

#[test]
fn fault_a_panel_and_a_film_were_absorbed_by_plants() {
    let mut scenery = tunnel(&[], 0.0);
    scenery.source(DVec3::NEG_Z, 100.0);
    let (_, all) = balance(&scenery.scene());
    near(all.absorbed_plants_W, 93.75);
    near(all.absorbed_structures_W, 0.0);

    let (_, balance) = balance(&declared(&scenery, &KINDS));
    near(balance.absorbed_plants_W, 18.75);
    near(balance.absorbed_leaves_W, 12.5);
    near(balance.absorbed_stems_W, 6.25);
    near(balance.absorbed_structures_W, 75.0);
    near(balance.absorbed_soil_W, 6.25);
    let materials = balance.materials.iter();
    let materials: Vec<(&str, Kind)> = materials.map(|of| (&of.name[..], of.kind)).collect();
    let [panel, film, stem] = KINDS;
    assert_eq!(materials, [panel, film, ("leaf", Kind::Leaf), stem]);
    for (of, expected) in balance.materials.iter().zip([50.0, 25.0, 12.5, 6.25]) {
        near(of.absorbed_W, expected);
    }
}

#[test]
fn what_is_declared_changes_where_light_counts_and_no_number() {
    let optics = [
        ("panel", LeafOptics::symmetric(0.2, 0.5)),
        ("film", LeafOptics::opaque(0.6)),
        ("leaf", LeafOptics::symmetric(0.45, 0.45)),
        ("stem", LeafOptics::opaque(0.5)),
    ];
    let mut scenery = tunnel(&optics, 0.25);
    scenery.source(from_zenith(35.0, 20.0), 100.0);
    let (plain, all) = balance(&scenery.scene());
    let (solution, balance) = balance(&declared(&scenery, &KINDS));
    assert_eq!(solution.organs, plain.organs);
    assert_eq!(solution.triangles, plain.triangles);
    assert_eq!(solution.soil, plain.soil);
    let same = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
    let Balance {
        absorbed_plants_W: plants,
        absorbed_structures_W: structures,
        ..
    } = balance;
    assert!(
        structures.value > 10.0 && structures.se > 0.0,
        "{structures:?}"
    );
    same(plants.value + structures.value, all.absorbed_plants_W.value);
    same(
        balance.absorbed_leaves_W.value + balance.absorbed_stems_W.value,
        plants.value,
    );
    let of_materials: f64 = balance.materials.iter().map(|of| of.absorbed_W.value).sum();
    same(of_materials, plants.value + structures.value);
    same(
        balance.incoming_W,
        plants.value
            + structures.value
            + balance.absorbed_soil_W.value
            + balance.escaped_up_W.value
            + balance.closure_W.value,
    );
    same(balance.closure_W.value, all.closure_W.value);
    same(balance.closure_W.se, all.closure_W.se);
    // errors are those of plants
    assert!(solution.account != plain.account);

    // nor does it make a plant of what is neither
    let (_, earth) = self::balance(&declared(&scenery, &[("film", Kind::Soil)]));
    let film = &balance.materials[1].absorbed_W;
    let soil = balance.absorbed_soil_W.value;
    let apart = earth.absorbed_soil_W.value - soil - film.value;
    assert!(apart.abs() < 1.0 && film.value > 1.0, "{apart}, {film:?}");
    assert_eq!(earth.absorbed_structures_W, Estimate::default());
}
