use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

use nestrad_tests::crew::{Process, Solving, worker};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, nestrad, until};

use super::{SCENE, maize};

/// Long enough for workers to fail in.
const FINE: [&str; 2] = ["--accuracy", "0.3"];

#[test]
fn a_worker_that_is_killed_loses_nothing() {
    let (desk, expected) = maize(&FINE);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &FINE);
    let victim = worker(solving.address, &[]);
    let mut other = worker(solving.address, &[]);
    victim.says("block is ready");
    victim.signal("KILL");
    solving.succeeds();
    assert!(other.ends().success(), "{}", other.log());
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_solve_survives_all_its_workers() {
    let (desk, expected) = maize(&FINE);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &FINE);
    let mut victims = [0, 1].map(|_| worker(solving.address, &[]));
    for victim in &mut victims {
        victim.says("block is ready");
        victim.signal("KILL");
        victim.ends();
    }
    let mut late = worker(solving.address, &[]);
    solving.succeeds();
    assert!(late.ends().success(), "{}", late.log());
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_worker_that_is_told_to_stop_leaves_with_0() {
    let (desk, expected) = maize(&FINE);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &FINE);
    let mut first = worker(solving.address, &[]);
    first.says("block is ready");
    first.signal("TERM");
    assert!(first.ends().success(), "{}", first.log());
    assert!(first.log().contains("told to stop") && first.log().contains("left"));
    let _second = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_worker_that_hangs_holds_nothing_up() {
    let (desk, expected) = maize(&FINE);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &FINE);
    let stuck = worker(solving.address, &[]);
    stuck.says("block is ready");
    stuck.signal("STOP");
    let _other = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
    stuck.signal("CONT");
}

#[test]
fn a_later_round_whose_workers_are_all_killed_is_finished_by_the_master() {
    let (desk, expected) = maize(&FINE);
    let args = ["solve", SCENE, "--out", "there", "--workers", "2"];
    let args = [&args[..], &FINE].concat();
    let mut solving = Process::start(nestrad(desk.folder(), &args));
    solving.says("round 1 reached");
    // a round begins with workers of its own
    for _ in 0..50 {
        for worker in solving.children() {
            // it may have ended by itself
            let _ = Command::new("kill")
                .args(["-KILL", &worker.to_string()])
                .output();
        }
        sleep(Duration::from_millis(20));
    }
    assert_eq!(solving.ends().code(), Some(0), "{}", solving.log());
    let log = solving.log();
    assert!(log.contains("all 2 worker processes have ended"), "{log}");
    assert!(log.contains("target 0.3 % met"), "{log}");
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_worker_too_small_for_the_smallest_block_fails_no_solve() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    let small = worker(solving.address, &["--memory", "0.02"]);
    small.says("joined");
    let mut large = worker(solving.address, &["--memory", "2"]);
    solving.succeeds();
    assert!(large.ends().success(), "{}", large.log());
    assert!(expected == desk.tables("there"));
    // alone with it, the master does not wait for others
    let mut solving = Solving::begin(desk.folder(), SCENE, "alone", &[]);
    let small = worker(solving.address, &["--memory", "0.02"]);
    small.says("idle: the smallest block needs");
    solving.succeeds();
    let log = solving.process.log();
    assert!(log.contains("is idle: the smallest block needs"), "{log}");
    assert!(expected == desk.tables("alone"));
    // and its own processes are no better
    let memory = ["--memory", "0.18"];
    desk.done(&[&["solve", SCENE, "--out", "less"], &memory[..]].concat());
    let args = ["solve", SCENE, "--out", "own", "--workers", "4"];
    desk.done(&[&args[..], &memory].concat());
    assert!(desk.tables("less") == desk.tables("own"));
}

#[test]
fn a_worker_that_is_too_small_is_shown_so() {
    let desk = Desk::new();
    desk.maize("maize", "1");
    let master = Master::start(&[]);
    let small = worker(master.address, &["--memory", "0.02"]);
    small.says("joined");
    let url = master.url();
    let long = ["solve", "maize/scene.toml", "--accuracy", "0.1"];
    let more = ["--out", "none", "--master", &url];
    let mut solving = Process::start(nestrad(desk.folder(), &[long, more].concat()));
    until("it is shown", || {
        let shown = desk.done(&["status", "--master", &url]).stdout;
        String::from_utf8_lossy(&shown).contains("idle: too small, the smallest block needs")
    });
    // stopped while it runs, it is cancelled
    solving.signal("TERM");
    assert_eq!(solving.ends().code(), Some(130), "{}", solving.log());
}
