//! What cannot be solved is refused with a line that says where and why, and nothing is written.

use super::desk::{Desk, SOLVE, SOLVE_BY_FLAGS, files};

/// Runs what must fail; the message is one line that holds all of `said`.
fn refused(desk: &Desk, args: &[&str], said: &[&str]) {
    let ran = desk.run(args);
    assert_eq!(ran.code, Some(1), "{args:?}: {}", ran.stderr);
    assert_eq!(ran.stdout, "");
    let message = ran.stderr.lines().last().unwrap_or_default();
    assert!(message.starts_with("error: "), "{message}");
    for part in said {
        assert!(message.contains(part), "{part}: {message}");
    }
    assert!(!ran.stderr.contains("panicked"), "{}", ran.stderr);
}

/// One file of the scene is replaced by something that is refused.
#[test]
fn bad_files_are_refused_with_their_name_and_line() {
    let triangle = "p 1 100001001001 3 0 0 0.1 0.1 0 0.1 0 0.1 0.1\n";
    let cases: &[(&str, &[u8], &[&str])] = &[
        (
            "plants.can",
            b"\x7fELF\x02\x01\0\xff\n",
            &["plants.can, line 1"],
        ),
        ("plants.can", b"", &["plants.can", "at least one triangle"]),
        (
            "plants.can",
            b"# nothing\n",
            &["plants.can", "at least one triangle"],
        ),
        (
            "plants.can",
            b"# one\np 1 100001001001 3 0 0 nan 0.1 0 0.1 0 0.1 0.1\n",
            &["plants.can, line 2", "z of vertex 1", "'nan'"],
        ),
        (
            "plants.can",
            b"p 1 100001001001 3 0 0 inf 0.1 0 0.1 0 0.1 0.1\n",
            &["plants.can, line 1", "'inf'"],
        ),
        (
            "plants.can",
            b"p 1 100001001001 3 0 0 0.1 0.1 0 0.1 0 0.1\n",
            &["plants.can, line 1", "z of vertex 3"],
        ),
        (
            "plants.can",
            b"p 1 700001001001 3 0 0 0.1 0.1 0 0.1 0 0.1 0.1\n",
            &["plants.can, line 1", "species 7", "par.opt"],
        ),
        (
            "plants.can",
            b"\x1f\x8b\x08\0\0\0\0",
            &["plants.can", "cannot be read"],
        ),
        (
            "par.opt",
            b"n 1\ns d 0.15\ne d 0.12 d 0.69 0.35 d 0.11 0.05\n",
            &["par.opt, line 3", "rho = 0.69 and tau = 0.35"],
        ),
        (
            "nir.opt",
            b"n 1\ns d 0.15\ne d -0.12 d 0.69 0.05 d 0.11 0.05\n",
            &["nir.opt, line 3", "-0.12"],
        ),
        (
            "day.light",
            b"400 0 0 -1\n10 0.1 0 0.5\n",
            &["day.light, line 2", "points down"],
        ),
        (
            "day.light",
            b"-1 0 0 -1\n",
            &["day.light, line 1", "found -1"],
        ),
        ("day.light", b"", &["day.light", "at least one source"]),
        (
            "ground.8",
            b"0 0\n1 0\n",
            &["ground.8, line 2", "apart in x and in y"],
        ),
        ("ground.8", b"0 0\n", &["ground.8", "line"]),
        ("scene.toml", b"scene = 3\n", &["scene.toml, line 1"]),
        (
            "scene.toml",
            b"scene = \"plants.can\"\ncolour = 1\n",
            &["scene.toml, line 2", "colour"],
        ),
        ("scene.toml", b"scene = \"no.can\"\n", &["expected"]),
    ];
    for (name, content, said) in cases {
        let desk = Desk::new();
        desk.put(name, content);
        refused(&desk, &SOLVE, said);
        assert!(!desk.path("out").exists(), "{name}");
        // and it is this one fault that is refused
        if *name == "plants.can" {
            desk.put(name, triangle);
            desk.done(&SOLVE);
        }
    }
}

#[test]
fn missing_files_are_named() {
    for name in ["plants.can", "par.opt", "nir.opt", "day.light", "ground.8"] {
        let desk = Desk::new();
        std::fs::remove_file(desk.path(name)).unwrap();
        refused(&desk, &SOLVE_BY_FLAGS, &[name, "cannot be read"]);
        assert!(!desk.path("out").exists(), "{name}");
    }
    refused(
        &Desk::new(),
        &["solve", "no.toml", "--out", "out"],
        &["no.toml", "cannot be read"],
    );
}

#[test]
fn what_the_flags_leave_out_is_asked_for() {
    let desk = Desk::new();
    let solve = ["solve", "plants.can", "--out", "out"];
    refused(&desk, &solve, &["at least one band", "--optics"]);
    let dark = [&solve[..], &["--optics", "PAR=par.opt"]].concat();
    refused(&desk, &dark, &["expected light", "--light"]);
}

#[test]
fn values_that_cannot_be_are_refused() {
    let by_flags = |more: &[&'static str]| [&SOLVE[..], more].concat();
    for (more, said) in [
        (&["--soil", "nan"][..], "soil height"),
        (&["--light", "X=day.light"], "light is given for bands X"),
        (
            &["--sky", "uniform-overcast", "--irradiance", "PAR=500"],
            "expected PAR, NIR",
        ),
        (
            &[
                "--sky",
                "uniform-overcast",
                "--irradiance",
                "PAR=-5",
                "--irradiance",
                "NIR=5",
            ],
            "band PAR",
        ),
        (
            &[
                "--sky",
                "clear",
                "--irradiance",
                "PAR=5",
                "--irradiance",
                "NIR=5",
                "--time",
                "2024-06-21T00:00:00Z",
                "--latitude",
                "45",
                "--longitude",
                "-3",
                "--diffuse-fraction",
                "0.2",
            ],
            "the sun is below the horizon",
        ),
    ] {
        let desk = Desk::new();
        refused(&desk, &by_flags(more), &[said]);
        assert!(!desk.path("out").exists(), "{more:?}");
    }
}

#[test]
fn a_failure_leaves_an_earlier_result_as_it_was() {
    let desk = Desk::new();
    desk.done(&SOLVE);
    desk.put("out/notes.txt", "my own");
    let before = files(&desk.path("out"));
    desk.put("par.opt", "n 1\n");
    refused(&desk, &SOLVE, &["par.opt"]);
    assert!(files(&desk.path("out")) == before);
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_the_work() {
    let desk = Desk::new();
    let out = ["solve", "scene.toml", "--out", "par.opt/out"];
    refused(&desk, &out, &["cannot write par.opt/out"]);
}
