//! What is solid: what encloses something, and not what is called a stem.

#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::fs;

use glam::DVec3;
use nestrad_common::assemble::{load, load_scene_file};
use nestrad_engine::solution::ItemLight;
use nestrad_tests::solving::{ESTIMATORS, by, solve};
use nestrad_tests::statistics::assert_close;

/// A pot of 16 walls with a bottom, all of whose faces look outwards, around a leaf: light on the leaf. `leaf` is the
/// number that the pot has in its label; `lid` closes it.
fn leaf_in_a_pot(leaf: u32, lid: bool) -> Vec<ItemLight> {
    const WALLS: usize = 16;
    let at = |k: usize, z: f64| {
        let angle = std::f64::consts::TAU * (k % WALLS) as f64 / WALLS as f64;
        DVec3::new(0.1 * angle.cos(), 0.1 * angle.sin(), z)
    };
    let mut text = String::new();
    let mut polygon = |label: &str, corners: &[DVec3]| {
        let _ = write!(text, "p 1 {label} {}", corners.len());
        for p in corners {
            let _ = write!(text, " {} {} {}", p.x, p.y, p.z);
        }
        text.push('\n');
    };
    let pot = format!("100001{leaf:03}001");
    for k in 0..WALLS {
        polygon(
            &pot,
            &[at(k, 0.1), at(k + 1, 0.1), at(k + 1, 0.25), at(k, 0.25)],
        );
    }
    let ring = |z: f64| (0..WALLS).map(|k| at(k, z)).collect::<Vec<_>>();
    let mut bottom = ring(0.1);
    bottom.reverse();
    polygon(&pot, &bottom);
    if lid {
        polygon(&pot, &ring(0.25));
    }
    let leaf: Vec<DVec3> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .iter()
        .map(|(x, y)| DVec3::new(0.05 * x, 0.05 * y, 0.18))
        .collect();
    polygon("100002001001", &leaf);

    on_the_leaf("scene.can", &text, "optics = \"band.opt\"\n")
}

/// Light on the leaf, by each estimator: the only organ of plant 2.
fn on_the_leaf(name: &str, text: &str, optics: &str) -> Vec<ItemLight> {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    file(name, text);
    file("band.opt", "n 1\ns d 0.2\ne d 0.6 d 0.6 0 d 0.6 0\n");
    file("sun.light", "100 0.1 0.2 -0.9\n");
    let head = format!("scene = \"{name}\"\nsoil = 0\nlight = \"sun.light\"\n");
    let bands = format!("[[bands]]\nname = \"B\"\n{optics}");
    file(
        "scene.toml",
        &format!("{head}[kinds]\nmaterials = {{ wall = 'stem' }}\n{bands}"),
    );
    let inputs = load_scene_file(&folder.path().join("scene.toml")).unwrap();
    let scene = load(&inputs).unwrap().scene;
    let number = scene.canopy.organs.iter().position(|o| o.plant == "2");
    let on_leaf = |estimator| solve(&scene, &by(estimator)).solution.organs[number.unwrap()];
    ESTIMATORS.map(on_leaf).to_vec()
}

/// The same pot as OBJ, its walls of the material `wall`, which is declared to be a stem: its transmittance is `tau`.
fn leaf_in_a_pot_of_obj(tau: f64, lid: bool) -> Vec<ItemLight> {
    const WALLS: usize = 16;
    let mut text = String::new();
    for z in [0.1, 0.25] {
        for k in 0..WALLS {
            let angle = std::f64::consts::TAU * k as f64 / WALLS as f64;
            let _ = writeln!(text, "v {} {} {z}", 0.1 * angle.cos(), 0.1 * angle.sin());
        }
    }
    text.push_str("v -0.05 -0.05 0.18\nv 0.05 -0.05 0.18\nv 0.05 0.05 0.18\nv -0.05 0.05 0.18\n");
    text.push_str("o 1\ng pot\nusemtl wall\n");
    for k in 0..WALLS {
        let next = (k + 1) % WALLS;
        let (above, beside) = (WALLS + next + 1, WALLS + k + 1);
        let _ = writeln!(text, "f {} {} {above} {beside}", k + 1, next + 1);
    }
    let mut ring = |numbers: &mut dyn Iterator<Item = usize>| {
        let numbers: Vec<String> = numbers.map(|n| n.to_string()).collect();
        let _ = writeln!(text, "f {}", numbers.join(" "));
    };
    ring(&mut (1..=WALLS).rev());
    if lid {
        ring(&mut (WALLS + 1..=2 * WALLS));
    }
    text.push_str("o 2\ng leaf\nusemtl leaf\nf -4 -3 -2 -1\n");
    let optics = format!(
        "soil_albedo = 0.2\n[bands.materials]\nwall = {{ rho = 0.5, tau = {tau:?} }}\nleaf = {{ rho = 0.4 }}\n"
    );
    on_the_leaf("scene.obj", &text, &optics)
}

/// The leaf got nothing from below, whatever the pot sent there.
#[test]
fn fault_a_leaf_in_an_open_pot_was_dark_from_below() {
    let [of_stem, of_leaf] = [0, 7].map(|label| leaf_in_a_pot(label, false));
    for (a, b) in of_stem.iter().zip(&of_leaf) {
        let se = a.absorbed_se_W.hypot(b.absorbed_se_W);
        assert_close(
            "absorbed",
            a.absorbed_W,
            b.absorbed_W,
            se,
            4.0,
            0.05 * b.absorbed_W,
        );
        let (found, expected) = (a.irradiance_lower_W_m2, b.irradiance_lower_W_m2);
        assert!(
            found > 1.0 && (found / expected - 1.0).abs() < 0.1,
            "{found} of {expected}"
        );
    }
}

#[test]
fn a_leaf_in_a_closed_pot_is_dark() {
    for leaf in leaf_in_a_pot(0, true) {
        assert_eq!(leaf.absorbed_W, 0.0);
    }
}

#[test]
fn a_stem_of_obj_is_solid_if_it_encloses_something_and_is_opaque() {
    for leaf in leaf_in_a_pot_of_obj(0.0, true) {
        assert_eq!(leaf.absorbed_W, 0.0);
    }
    // what passes through the walls is inside
    for leaf in leaf_in_a_pot_of_obj(0.3, true) {
        assert!(leaf.absorbed_W > 0.0);
    }
    for leaf in leaf_in_a_pot_of_obj(0.0, false) {
        assert!(leaf.irradiance_upper_W_m2 > 1.0 && leaf.irradiance_lower_W_m2 > 1.0);
    }
}
