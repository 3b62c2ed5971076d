//! Input without end, and results that have no place.

use std::fs::{self, File};
use std::io::Write;
use std::os::unix::fs::symlink;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use crate::desk::{Desk, SOLVE};

/// Long before a file of a terabyte is read.
const SOON: Duration = Duration::from_secs(20);

/// A file to be read, and the command that reads it.
type Read = (&'static str, &'static [&'static str]);

const READ: [Read; 10] = [
    ("scene.toml", &SOLVE),
    ("plants.can", &SOLVE),
    ("plants.can", &["check", "scene.toml"]),
    ("par.opt", &SOLVE),
    ("day.light", &SOLVE),
    ("ground.8", &SOLVE),
    (
        "plants.obj",
        &["check", "plants.obj", "--optics", "PAR=par.opt"],
    ),
    ("plants.ply", &["check", "plants.ply"]),
    (
        "token",
        &[
            "solve",
            "scene.toml",
            "--out",
            "out",
            "--master",
            "http://127.0.0.1:1",
            "--token-file",
            "token",
        ],
    ),
    (
        "ca.pem",
        &[
            "status",
            "--master",
            "https://127.0.0.1:1",
            "--ca",
            "ca.pem",
        ],
    ),
];

fn refused(desk: &Desk, name: &str, args: &[&str]) -> String {
    let begun = Instant::now();
    let ran = desk.run(args);
    assert!(matches!(ran.code, Some(1 | 4)), "{args:?}: {}", ran.stderr);
    assert!(ran.stderr.contains(name), "{args:?}: {}", ran.stderr);
    assert!(begun.elapsed() < SOON, "{args:?}");
    assert!(!desk.path("out").exists());
    ran.stderr
}

#[test]
fn input_without_end_was_read_without_bounds() {
    for (name, args) in READ {
        let desk = Desk::new();
        let path = desk.path(name);
        let _ = fs::remove_file(&path);
        symlink("/dev/zero", &path).unwrap();
        let said = refused(&desk, name, args);
        assert!(
            said.contains("found a device") || name == "plants.ply",
            "{said}"
        );

        fs::remove_file(&path).unwrap();
        File::create(&path).unwrap().set_len(1 << 40).unwrap();
        let said = refused(&desk, name, args);
        assert!(
            said.contains("the file is larger than") || name == "plants.ply",
            "{said}"
        );
    }
}

#[test]
fn a_pipe_that_never_ends_was_read_without_bounds() {
    for (name, text, expected) in [
        (
            "plants.can",
            &[0; 1 << 16][..],
            "its first line is longer than 1.000 MiB",
        ),
        (
            "par.opt",
            b"# a comment\n",
            "what comes out of the pipe is larger than 16.000 MiB",
        ),
        // canopies for ever, with little memory for one
        (
            "plants.can",
            b"p 1 100001000001 3 0.20 0.20 0 0.22 0.20 0 0.21 0.20 0.30\n",
            "larger than 51.200 MiB (half of --memory)",
        ),
    ] {
        let desk = Desk::new();
        let path = desk.path(name);
        fs::remove_file(&path).unwrap();
        let made = Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        let text = text.repeat((1 << 16) / text.len());
        let writer = thread::spawn(move || {
            let mut pipe = File::options().write(true).open(path).unwrap();
            while pipe.write_all(&text).is_ok() {}
        });
        let said = refused(&desk, name, &[&SOLVE[..], &["--memory", "0.1"]].concat());
        assert!(said.contains(expected), "{said}");
        writer.join().unwrap();
    }
}

#[test]
fn results_without_end_are_no_report() {
    let desk = Desk::new();
    desk.done(&SOLVE);
    fs::rename(desk.path("out"), desk.path("results")).unwrap();
    for name in ["summary.json", "organs.csv", "triangles.csv", "soil.csv"] {
        let path = desk.path("results").join(name);
        let kept = fs::read(&path).unwrap();
        fs::remove_file(&path).unwrap();
        symlink("/dev/zero", &path).unwrap();
        refused(&desk, name, &["report", "results"]);
        fs::remove_file(&path).unwrap();
        File::create(&path).unwrap().set_len(1 << 40).unwrap();
        refused(&desk, name, &["report", "results"]);
        // and the whole result with the line ends of an old Mac
        let text = String::from_utf8(kept).unwrap();
        fs::write(&path, text.replace('\n', "\r")).unwrap();
    }
    desk.done(&["report", "results"]);
}

#[test]
fn a_lone_carriage_return_ends_a_line_in_every_file() {
    let desk = Desk::new();
    desk.done(&SOLVE);
    let tables = ["organs.csv", "triangles.csv", "soil.csv"];
    let expected = tables.map(|name| desk.text(&format!("out/{name}")));
    for name in [
        "scene.toml",
        "plants.can",
        "par.opt",
        "nir.opt",
        "day.light",
        "ground.8",
    ] {
        let text = format!("# first\n{}", desk.text(name));
        desk.put(name, text.replace('\n', "\r"));
    }
    desk.done(&SOLVE);
    assert_eq!(
        tables.map(|name| desk.text(&format!("out/{name}"))),
        expected
    );
    // lines are counted as they are
    desk.put("day.light", "# first\r400 0 0 1\r");
    let ran = desk.run(&SOLVE);
    assert!(ran.stderr.contains("day.light, line 2"), "{}", ran.stderr);
}

#[test]
fn check_passed_what_solve_refuses() {
    let desk = Desk::new();
    let good = desk.text("scene.toml");
    let options = |text: &str| format!("{good}[options]\n{text}\n");
    for scene in [
        options("accuracy_percent = 0.001"),
        options("memory_GiB = 1e-6"),
        good.replace("\"ground.8\"", "[0, 0, 0.002, 1]"),
        good.replace("\"ground.8\"", "[0, 0, 1e-5, 1]"),
        good.replace("-0.01", "-1e9"),
        good.replace("-0.01", "-1e5"),
        good.replace("-0.01", "nan"),
        good.replace("plants.can\"", "plants.can\"\nunit = \"mm\"")
            .replace("\"ground.8\"", "[0, 0, 1e-8, 1]"),
        good.replace("NIR", "PAR"),
        good.replace("NIR", &"N".repeat(5000)),
        good.replace("\"day.light\"", "{ files = { PAR = \"day.light\" } }"),
        good.replace(
            "\"day.light\"",
            "{ sky = { kind = \"uniform_overcast\", irradiance_W_m2 = { PAR = 1e300, NIR = 1 } } }",
        ),
    ] {
        desk.put("scene.toml", &scene);
        let solved = desk.run(&SOLVE);
        let checked = desk.run(&["check", "scene.toml"]);
        assert_ne!(solved.code, Some(0), "{scene}");
        assert_eq!(checked.code, solved.code, "{scene}: {}", solved.stderr);
        let last = |text: &str| text.lines().last().unwrap().to_owned();
        assert_eq!(last(&checked.stderr), last(&solved.stderr), "{scene}");
    }
    // what is not given yet is not asked for, and what is given is looked at nevertheless
    desk.put("scene.toml", good);
    let refused = ["check", "plants.can", "--soil", "-1e9"];
    let ran = desk.run(&refused);
    assert_ne!(ran.code, Some(0));
    desk.done(&["check", "plants.can", "--soil", "-1"]);
}

#[test]
fn a_folder_in_the_place_of_a_table_was_found_after_computing() {
    let desk = Desk::new();
    for name in [
        "organs.csv",
        "triangles.parquet",
        "canopy.vtp",
        "report.html",
        "summary.json",
    ] {
        let place = desk.path("out").join(name);
        fs::create_dir_all(&place).unwrap();
        let ran = desk.run(&SOLVE);
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
        assert!(ran.stderr.contains(name), "{}", ran.stderr);
        assert!(
            ran.stderr.contains("a folder of that name exists"),
            "{}",
            ran.stderr
        );
        assert!(!ran.stderr.contains("plan:"), "{}", ran.stderr);
        fs::remove_dir(&place).unwrap();
    }
    for name in ["trade.csv", "trade.html", "trade.jsonl"] {
        let place = desk.path("study").join(name);
        fs::create_dir_all(&place).unwrap();
        let begun = Instant::now();
        let ran = desk.run(&["trade", "scene.toml", "--out", "study"]);
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
        assert!(
            ran.stderr.contains(name) && begun.elapsed() < SOON,
            "{}",
            ran.stderr
        );
        fs::remove_dir(&place).unwrap();
    }
    symlink("no/such/place", desk.path("link")).unwrap();
    for out in ["day.light", "day.light/out", "link", "link/out"] {
        let ran = desk.run(&["solve", "scene.toml", "--out", out]);
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
        assert!(
            ran.stderr.contains(&format!("cannot write {out}")),
            "{}",
            ran.stderr
        );
        assert!(!ran.stderr.contains("plan:"), "{}", ran.stderr);
    }
    desk.done(&SOLVE);
    for (name, args) in [
        ("report.html", &["report", "out"][..]),
        ("a.png", &["report", "out", "--png", "a.png"]),
    ] {
        let place = if name == "a.png" {
            desk.path(name)
        } else {
            desk.path("out").join(name)
        };
        fs::create_dir_all(&place).unwrap();
        let ran = desk.run(args);
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
        assert!(ran.stderr.contains(name), "{}", ran.stderr);
        fs::remove_dir(&place).unwrap();
    }
}
