//! `nestrad check` says what is there and computes nothing.

use std::process::Stdio;

use super::desk::{Desk, files};

#[test]
fn a_good_scene_is_described() {
    let desk = Desk::new();
    let before = files(&desk.path("."));
    let ran = desk.done(&["check", "scene.toml"]);
    for fact in [
        "triangles 4 in 3 organs of 2 plants",
        "pattern   1.000 m by 1.000 m; the scene reaches 0.150 m beyond it",
        "soil      a plane at z = -0.010 m",
        "material  leaf of species 1: 3 triangles",
        "band      PAR: soil rho 0.15",
        "light     3 sources: PAR 500.00 W m⁻², NIR 500.00 W m⁻²",
    ] {
        assert!(ran.stdout.contains(fact), "{fact}: {}", ran.stdout);
    }
    assert_eq!(ran.stderr, "");
    assert!(files(&desk.path(".")) == before);
}

#[test]
fn what_is_odd_is_a_warning_and_no_error() {
    let desk = Desk::new();
    let flat = "p 1 100001001001 3 0 0 0.1 0.1 0 0.1 0.2 0 0.1\n";
    desk.put("plants.can", desk.text("plants.can") + flat);
    let ran = desk.done(&["check", "scene.toml"]);
    let warning = "warning   1 triangle without area, for which no light is computed, the first in plants.can, line 5";
    assert!(ran.stdout.contains(warning), "{}", ran.stdout);
}

#[test]
fn what_is_wrong_is_an_error_after_what_is_known() {
    let desk = Desk::new();
    let ran = desk.run(&["check", "plants.can", "--light", "day.light"]);
    assert_eq!(ran.code, Some(1));
    assert!(ran.stdout.contains("triangles 4 in 3 organs"));
    assert!(
        ran.stderr.contains("expected at least one band"),
        "{}",
        ran.stderr
    );
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let desk = Desk::new();
    let mut child = desk
        .command(&["check", "scene.toml"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success() && output.stderr.is_empty());
}
