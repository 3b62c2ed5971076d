//! What people bring, and what they are told of it.

use super::desk::{Desk, SOLVE};

/// The error of a run that fails.
fn refusal(desk: &Desk, args: &[&str], code: i32) -> String {
    let ran = desk.run(args);
    assert_eq!(ran.code, Some(code), "{args:?}: {}", ran.stderr);
    let error = ran.stderr.lines().next().unwrap_or_default();
    let error = error.strip_prefix("error: ").unwrap_or(error);
    error.to_owned()
}

#[test]
fn fault_what_is_no_scene_was_met_with_a_question_for_optics() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("demo")).unwrap();
    desk.put("demo/scene.toml", "");
    std::fs::create_dir(desk.path("empty")).unwrap();
    desk.put("broken.obj", "v 0 0 0\nv 1 0 0\nv 0 x 0\nf 1 2 3\n");
    desk.put(
        "plant.ply",
        "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
    );
    desk.put("plant.can", "ply\nformat ascii 1.0\n");
    let scene = "expected a scene file (.toml), CAN (.can) or OBJ (.obj)";
    for (file, said) in [
        ("demo", format!("demo: cannot be read: {scene}, found a folder; its scene is demo/scene.toml")),
        ("empty", format!("empty: cannot be read: {scene}, found a folder")),
        (
            "missing.toml",
            "missing.toml: cannot be read: expected a scene file (.toml), found no file of that name".to_owned(),
        ),
        ("missing.can", format!("missing.can: cannot be read: {scene}, found no file of that name")),
        (
            "broken.obj",
            "broken.obj, line 3: expected y of vertex 3, a finite number, found 'x'".to_owned(),
        ),
        (
            "plant.ply",
            "plant.ply: expected geometry as CAN (.can) or OBJ (.obj), found a file of the kind .ply".to_owned(),
        ),
        (
            "plant.can",
            "plant.can, line 1: expected 'p', with which each line of a CAN file begins (the name of an OBJ file \
             ends in .obj), found 'ply'"
                .to_owned(),
        ),
    ] {
        assert_eq!(refusal(&desk, &["check", file], 1), said);
    }
    let missing = ["check", "plants.can", "--optics", "PAR=no.opt"];
    let said = "no.opt: cannot be read: expected optics (.opt), found no file of that name";
    assert_eq!(refusal(&desk, &missing, 1), said);
}

#[test]
fn fault_numbers_that_are_none_were_said_in_the_words_of_a_programmer() {
    let desk = Desk::new();
    let solve = |more: &[&'static str]| [&SOLVE[..], more].concat();
    for (args, flag, said) in [
        (
            solve(&["--threads", "3.5"]),
            "--threads <N>",
            "expected a whole number from 0 to 4096",
        ),
        (
            solve(&["--threads", "-1"]),
            "--threads <N>",
            "expected a whole number from 0 to 4096",
        ),
        (
            solve(&["--threads", "5000"]),
            "--threads <N>",
            "expected a whole number from 0 to 4096",
        ),
        (
            solve(&["--seed", "1e3"]),
            "--seed <N>",
            "expected a whole number, 0 or more",
        ),
        (
            solve(&["--workers", "two"]),
            "--workers <N>",
            "expected a whole number from 1 to 1024",
        ),
        (
            solve(&["--soil", "0,5"]),
            "--soil <Z>",
            "expected a number, such as 0.5",
        ),
        (solve(&["--up", "x"]), "--up <AXIS>", "expected y or z"),
        (
            vec!["generate", "random", "--lai", "much", "--out", "demo"],
            "--lai <LAI>",
            "expected a number, such as 0.5",
        ),
        (
            vec!["generate", "maize", "--seed", "-1", "--out", "demo"],
            "--seed <N>",
            "expected a whole number, 0 or more",
        ),
    ] {
        let error = refusal(&desk, &args, 2);
        assert!(
            error.contains(flag) && error.contains(said),
            "{args:?}: {error}"
        );
    }
}

#[test]
fn a_canopy_with_y_up_stands_as_with_z_up() {
    let desk = Desk::new();
    let facts = |args: &[&str]| {
        let ran = desk.done(&[&["check"], args].concat());
        let extent = ran.stdout.lines().find(|line| line.starts_with("extent"));
        extent.unwrap_or_default().to_owned()
    };
    desk.put("lying.obj", "v 0 0 0\nv 1 2 0\nv 1 0 -3\nf 1 2 3\n");
    let stands = "extent    x 0.000 to 1.000 m, y 0.000 to 3.000 m, z 0.000 to 2.000 m";
    assert_eq!(facts(&["lying.obj", "--up", "y"]), stands);
    desk.put("lying.toml", "scene = \"lying.obj\"\nup = \"y\"\n");
    assert_eq!(facts(&["lying.toml"]), stands);
    let lies = "extent    x 0.000 to 1.000 m, y 0.000 to 2.000 m, z -3.000 to 0.000 m";
    assert_eq!(facts(&["lying.toml", "--up", "z"]), lies);
    // in all formats
    desk.put("lying.can", "p 1 100001001001 3 0 0 0 1 2 0 1 0 -3\n");
    assert_eq!(facts(&["lying.can", "--up", "y"]), stands);
}

#[test]
fn results_and_report_of_a_canopy_with_y_up_are_those_with_z_up() {
    let desk = Desk::new();
    let lying = desk
        .text("plants.can")
        .lines()
        .skip(1)
        .fold(String::new(), |lying, line| {
            let fields: Vec<&str> = line.split(' ').collect();
            let (label, numbers) = fields.split_at(4);
            let vertices = numbers.chunks(3).map(|v| {
                let y = v[1].parse::<f64>().unwrap();
                format!("{} {} {}", v[0], v[2], -y)
            });
            let vertices: Vec<String> = vertices.collect();
            format!("{lying}{} {}\n", label.join(" "), vertices.join(" "))
        });
    let solve = [&SOLVE[..], &["--accuracy", "10", "-q"]].concat();
    desk.done(&solve);
    let standing = desk.text("out/triangles.csv");
    desk.put("plants.can", lying);
    let scene = desk.text("scene.toml");
    desk.put("scene.toml", format!("up = \"y\"\n{scene}"));
    desk.done(&solve);
    assert_eq!(desk.text("out/triangles.csv"), standing);
    assert!(desk.text("out/summary.json").contains("\"up\": \"y\""));
    let ran = desk.done(&["report", "out"]);
    assert!(ran.stderr.contains("report.html"), "{}", ran.stderr);
}

#[test]
fn an_absurd_beam_is_solved_with_a_warning() {
    let desk = Desk::new();
    desk.put("day.light", "60 1 0 -0.01\n");
    let warning = "band PAR: a source 0.57 degrees above the horizon has 6000 W m-2 perpendicular to its direction, more \
                   than the sun outside the atmosphere (531 W m-2): is its irradiance right?";
    let ran = desk.done(&["check", "scene.toml"]);
    assert!(
        ran.stdout.contains(&format!("warning   {warning}")),
        "{}",
        ran.stdout
    );
    let ran = desk.done(&[&SOLVE[..], &["--accuracy", "20"]].concat());
    assert!(
        ran.stderr.contains(&format!("warning: {warning}")),
        "{}",
        ran.stderr
    );
}

#[test]
fn skies_have_the_names_of_the_scene_file_too() {
    let desk = Desk::new();
    for kind in [
        "uniform_overcast",
        "uniform-overcast",
        "standard_overcast",
        "standard-overcast",
    ] {
        let sky = [
            "--sky",
            kind,
            "--irradiance",
            "PAR=5",
            "--irradiance",
            "NIR=5",
        ];
        desk.done(&[&["check", "scene.toml"], &sky[..]].concat());
    }
}
