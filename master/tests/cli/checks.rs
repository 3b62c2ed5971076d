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
fn fault_check_asked_for_optics() {
    let desk = Desk::new();
    let ran = desk.done(&["check", "plants.can"]);
    for fact in [
        "triangles 4 in 3 organs",
        "band      none is given; solve needs one",
        "light     none is given; solve needs it",
    ] {
        assert!(ran.stdout.contains(fact), "{fact}: {}", ran.stdout);
    }
    let ran = desk.done(&["check", "plants.can", "--light", "day.light"]);
    let light = "light     3 sources: every band 500.00 W m⁻²\n\
                 sources   57.49 to 90.00 degrees above the horizon\n";
    assert!(ran.stdout.contains(light), "{}", ran.stdout);
    let light = [
        "check",
        "plants.can",
        "--light",
        "A=day.light",
        "--light",
        "B=day.light",
    ];
    let ran = desk.done(&light);
    assert!(
        ran.stdout.contains("A 500.00 W m⁻², B 500.00"),
        "{}",
        ran.stdout
    );
    desk.done(&["check", "plants.can", "--optics", "PAR=par.opt"]);
}

#[test]
fn all_that_is_wrong_is_said_after_what_is_known() {
    let desk = Desk::new();
    desk.put("par.opt", "n 0\ns d 0.1\n");
    desk.put("day.light", "100 0 0 1\n");
    let ran = desk.run(&["check", "scene.toml"]);
    assert_eq!(ran.code, Some(1));
    assert!(ran.stdout.contains("triangles 4 in 3 organs"));
    let errors: Vec<&str> = ran.stderr.lines().collect();
    assert!(errors[0].starts_with("error: plants.can, line 2: species 1 is not in par.opt"));
    assert!(errors[1].starts_with("error: day.light, line 1: expected a direction"));
    assert_eq!(errors.len(), 2, "{errors:?}");
}

#[test]
fn the_sun_is_said_in_degrees() {
    let desk = Desk::new();
    let sky = "[light.sky]\nkind = \"clear\"\ntime_utc = 2024-06-21T10:00:00+00:00\nlatitude_deg = 43.6\n\
               longitude_deg = 3.9\ndiffuse_fraction = 0.2\nirradiance_W_m2 = { PAR = 400, NIR = 380 }\n";
    let scene = desk
        .text("scene.toml")
        .replace("light = \"day.light\"\n", "");
    desk.put("clear.toml", format!("{scene}{sky}"));
    let sun =
        "60.29 degrees above the horizon, azimuth 124.09 degrees from north (y) through east (x)";
    let ran = desk.done(&["check", "clear.toml"]);
    assert!(
        ran.stdout.contains(&format!("sun       {sun}\n")),
        "{}",
        ran.stdout
    );
    let ran = desk.done(&[
        "solve",
        "clear.toml",
        "--accuracy",
        "20",
        "--budget",
        "0.1",
        "--out",
        "out",
    ]);
    assert!(
        ran.stderr.contains(&format!("plan: sun: {sun}\n")),
        "{}",
        ran.stderr
    );
    let summary = desk.text("out/summary.json");
    for number in ["\"elevation_deg\": 60.29", "\"azimuth_deg\": 124.09"] {
        assert!(summary.contains(number), "{summary}");
    }
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
