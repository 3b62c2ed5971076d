//! The Python package: its own tests, as they stand in the repository, against the programs that the tests have built.

#![allow(clippy::print_stderr, reason = "says why it was skipped")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{finish, program, said};

fn package() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../proto/python")
}

/// Makes a virtual environment with all that the tests need; false where that is not to be had.
fn set_up(venv: &Path) -> bool {
    let mut set_up = Command::new("sh");
    set_up.arg(package().join("set_up")).arg(venv);
    // packages come from elsewhere, and pip knows how long to wait for them
    let made = set_up.output().unwrap();
    match made.status.code() {
        Some(0) => true,
        Some(77) => {
            eprintln!("skipped: no Python 3 with its packages: {}", said(&made));
            false
        }
        _ => panic!("{}", said(&made)),
    }
}

#[test]
fn the_python_package_does_what_its_tests_say() {
    let desk = Desk::new();
    let venv = desk.path("venv");
    if !set_up(&venv) {
        return;
    }
    let tests = fs::read_dir(package().join("tests")).unwrap();
    let mut tests: Vec<PathBuf> = tests
        .map(|entry| entry.unwrap().path())
        .filter(|path| {
            let name = path.file_name().unwrap().to_string_lossy();
            name.starts_with("test_") && name.ends_with(".py")
        })
        .collect();
    tests.sort();
    assert!(tests.len() > 5, "{tests:?}");
    // one at a time: what hangs is stopped
    for test in tests {
        let mut python = Command::new(venv.join("bin/python"));
        python
            .args(["-m", "pytest", "-p", "no:cacheprovider", "--config-file"])
            .arg(package().join("pyproject.toml"))
            .arg(&test)
            .current_dir(desk.folder())
            .env("NESTRAD_PROGRAM", program("nestrad"))
            .env("PYTHONPATH", package().join("src"))
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env_remove("NESTRAD_TOKEN")
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let ran = finish(python);
        let told = String::from_utf8_lossy(&ran.stdout).into_owned() + &said(&ran);
        assert!(ran.status.success(), "{}: {told}", test.display());
        // skipped tests are named
        for line in told.lines().filter(|line| line.contains("SKIPPED")) {
            eprintln!("{line}");
        }
    }
}
