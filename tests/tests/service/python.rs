//! The client in Python: a crop model's time steps, in a virtual environment of its own, at a master with
//! a worker.

#![allow(clippy::print_stderr, reason = "says why it was skipped")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client};
use nestrad_tests::crew::worker;
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, finish, said, signal, until, wait_for};

fn sources() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("python")
}

/// The program of the README, ready to run; none where there is no Python with its packages.
fn time_step(desk: &Desk) -> Option<Command> {
    let venv = desk.path("venv");
    if !venv.exists() && !set_up(&venv) {
        return None;
    }
    let mut python = Command::new(venv.join("bin/python"));
    python
        .arg(sources().join("time_step.py"))
        .current_dir(desk.folder())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env_remove("NESTRAD_TOKEN")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    Some(python)
}

/// Makes a virtual environment with all that the program needs; false where that is not to be had.
fn set_up(venv: &Path) -> bool {
    let mut set_up = Command::new("sh");
    set_up.arg(sources().join("set_up")).arg(venv);
    set_up.stdout(Stdio::null()).stderr(Stdio::piped());
    let made = finish(set_up);
    match made.status.code() {
        Some(0) => true,
        Some(77) => {
            eprintln!("skipped: no Python 3 with its packages: {}", said(&made));
            false
        }
        _ => panic!("{}", said(&made)),
    }
}

/// Absorbed power by species, plant, organ and band, of one hour where a table has several.
fn absorbed_W(text: &str, hour: &str) -> HashMap<[String; 4], f64> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name);
    let rows = lines.map(|line| line.split(',').collect::<Vec<_>>());
    rows.filter(|row| column("hour").is_none_or(|h| row[h] == hour))
        .map(|row| {
            let key = ["species", "plant", "organ", "band"];
            let key = key.map(|name| row[column(name).unwrap()].to_owned());
            (key, row[column("absorbed_W").unwrap()].parse().unwrap())
        })
        .collect()
}

#[test]
fn a_crop_model_in_python_gets_the_numbers_of_the_command_line() {
    let desk = Desk::new();
    let Some(mut python) = time_step(&desk) else {
        return;
    };
    let token = desk.path("token");
    std::fs::write(&token, "a-token-of-the-crop-model").unwrap();
    let workers = desk.path("workers");
    std::fs::write(&workers, "a-token-of-the-workers").unwrap();
    let (token, workers) = (token.display().to_string(), workers.display().to_string());
    let master = Master::start(&["--client-token", &token, "--worker-token", &workers]);
    let worker = worker(master.address, &["--token-file", &workers]);
    worker.says("joined");
    python.args([
        "--master",
        &master.address.to_string(),
        "--out",
        "absorbed.csv",
    ]);
    python.args(["--files", "files", "--accuracy", "0.25"]);
    let ran = finish(python);
    assert!(!ran.status.success());
    assert!(
        said(&ran).contains("expected a bearer token"),
        "{}",
        said(&ran)
    );

    let mut python = time_step(&desk).unwrap();
    python.env("NESTRAD_TOKEN", "a-token-of-the-crop-model");
    python.args([
        "--master",
        &master.address.to_string(),
        "--out",
        "absorbed.csv",
    ]);
    python.args(["--files", "files", "--accuracy", "0.25"]);
    let ran = finish(python);
    assert!(ran.status.success(), "{}", said(&ran));
    for part in ["exchange: ", "exchange ", "solve "] {
        assert!(said(&ran).contains(part), "{part}: {}", said(&ran));
    }
    assert_eq!(String::from_utf8_lossy(&ran.stdout).lines().count(), 4);
    assert!(!master.log().contains("a-token") && !worker.log().contains("a-token"));
    assert!(master.metric("nestrad_worker_results_total") > 0.0);
    // one geometry for both hours
    assert_eq!(master.log().matches("scene uploaded").count(), 2);

    let text = std::fs::read_to_string(desk.path("absorbed.csv")).unwrap();
    for hour in ["0", "1"] {
        let scene = format!("files/scene-{hour}.toml");
        desk.done(&["solve", &scene, "--accuracy", "0.25", "--out", "out"]);
        let organs = std::fs::read_to_string(desk.path("out/organs.csv")).unwrap();
        let (there, here) = (absorbed_W(&text, hour), absorbed_W(&organs, hour));
        assert_eq!((there.len(), here.len()), (160, 160));
        for (key, value) in here {
            // tables have nine digits
            assert!((there[&key] - value).abs() <= 5e-9 * value, "{key:?}");
        }
    }
}

/// Longer than a cancellation takes.
const PRESSED_AGAIN: Duration = Duration::from_secs(5);

#[test]
fn ctrl_c_in_python_cancels_at_the_master() {
    let desk = Desk::new();
    let Some(mut python) = time_step(&desk) else {
        return;
    };
    let master = Master::start(&[]);
    python.args([
        "--master",
        &master.address.to_string(),
        "--out",
        "absorbed.csv",
    ]);
    let mut child = python.args(["--accuracy", "0.05"]).spawn().unwrap();
    let state = |wanted| {
        let list = block_on(async {
            let list = client(&master).list_solves(v1::ListSolvesRequest {}).await;
            list.unwrap().into_inner().solves
        });
        list.iter().any(|solve| solve.state() == wanted)
    };
    until("it runs", || state(v1::SolveState::Running));
    // Python drops an interrupt that comes while gRPC is in a callback, as anyone sees who has to press twice
    let mut pressed: Option<Instant> = None;
    until("it ends", || {
        if pressed.is_none_or(|at| at.elapsed() > PRESSED_AGAIN) {
            signal(child.id(), "INT");
            pressed = Some(Instant::now());
        }
        child.try_wait().unwrap().is_some()
    });
    let ran = wait_for(child);
    assert_eq!(ran.status.code(), Some(1), "{}", said(&ran));
    assert!(said(&ran).ends_with("cancelled\n"), "{}", said(&ran));
    assert!(!desk.path("absorbed.csv").exists());
    until("it stops", || state(v1::SolveState::Cancelled));
}
