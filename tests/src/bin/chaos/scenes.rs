//! The scenes of a run, with what an undisturbed solve makes of each.

use std::fs;
use std::io;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nestrad_tests::desk::TABLES;

use crate::bounds;
use crate::ground::Ground;
use crate::process::program;

/// Folder, and what `nestrad generate` is told.
const CANOPIES: [(&str, &[&str]); 4] = [
    ("leaves", &["random", "--lai", "1.5", "--leaf-area", "0.01"]),
    (
        "discs",
        &[
            "random",
            "--lai",
            "1",
            "--leaf-area",
            "0.01",
            "--shape",
            "disc",
            "--angles",
            "planophile",
        ],
    ),
    (
        "maize",
        &["maize", "--rows", "1x1", "--leaf-triangle", "0.0005"],
    ),
    (
        "bean",
        &["bean", "--rows", "1x1", "--leaf-triangle", "0.0005"],
    ),
];

/// Name, folder, and what `nestrad solve` is told besides.
const CASES: [(&str, &str, &[&str]); 8] = [
    ("leaves", "leaves", &[]),
    ("leaves, in rounds", "leaves", &["--accuracy", "1"]),
    ("discs", "discs", &["--accuracy", "2"]),
    ("discs, other seed", "discs", &["--seed", "7"]),
    ("maize", "maize", &[]),
    ("maize, in rounds", "maize", &["--accuracy", "1"]),
    (
        "maize under the sun",
        "maize",
        &["--light", "sun.light", "--accuracy", "2"],
    ),
    (
        "bean, with a far field",
        "bean",
        &["--diameter", "0.5", "--accuracy", "3"],
    ),
];

/// A scene and how it is solved.
pub(crate) struct Case {
    pub(crate) name: &'static str,
    /// Arguments of `nestrad solve`, without those of the place.
    pub(crate) arguments: Vec<String>,
    /// The tables of the undisturbed solve, `None` where there is none.
    expected: Vec<Option<Vec<u8>>>,
    pub(crate) took: Duration,
}

impl Case {
    /// Whether a folder has the tables of the undisturbed solve; names the first that differs.
    pub(crate) fn compare(&self, out: &Path) -> Result<(), String> {
        let found = tables(out);
        for ((name, found), expected) in TABLES.iter().zip(&found).zip(&self.expected) {
            match (found, expected) {
                (None, Some(_)) => return Err(format!("{name} is not there")),
                (Some(_), None) => return Err(format!("{name} is there")),
                (a, b) if a != b => return Err(format!("{name} differs")),
                _ => {}
            }
        }
        Ok(())
    }
}

fn tables(out: &Path) -> Vec<Option<Vec<u8>>> {
    let tables = TABLES.iter();
    tables.map(|name| fs::read(out.join(name)).ok()).collect()
}

/// Writes the scenes and solves each without any service.
pub(crate) fn make(ground: &Ground) -> io::Result<Vec<Case>> {
    for (name, what) in CANOPIES {
        run(ground, &[&["generate"], what, &["--out", name]].concat())?;
    }
    fs::write(
        ground.path("sun.light"),
        "700 0.3 0.2 -0.9\n40 -0.5 0.1 -0.8\n",
    )?;
    CASES.into_iter().map(|case| solved(ground, case)).collect()
}

fn solved(
    ground: &Ground,
    (name, folder, more): (&'static str, &str, &[&str]),
) -> io::Result<Case> {
    let scene = format!("{folder}/scene.toml");
    let memory = bounds::SOLVE_GIB.to_string();
    let arguments = [&["solve", &scene, "--memory", &memory], more].concat();
    let out = ground.path(&format!("expected {name}"));
    let begun = Instant::now();
    let place = out.display().to_string();
    run(ground, &[&arguments[..], &["--out", &place]].concat())?;
    Ok(Case {
        name,
        arguments: arguments.into_iter().map(str::to_owned).collect(),
        expected: tables(&out),
        took: begun.elapsed(),
    })
}

fn run(ground: &Ground, arguments: &[&str]) -> io::Result<()> {
    let program = program("nestrad");
    let output = Command::new(&program)
        .args(arguments)
        .current_dir(ground.folder())
        .stdin(Stdio::null())
        .output();
    let output = output.map_err(|error| {
        let path = program.display();
        io::Error::other(format!(
            "{path}: {error} (it is built by cargo build --workspace --bins)"
        ))
    })?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(io::Error::other(format!("nestrad {arguments:?}: {said}")))
}
