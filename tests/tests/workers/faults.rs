use nestrad_tests::crew::{Solving, worker};

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
fn a_solve_whose_own_workers_are_gone_says_so() {
    let (desk, _) = maize(&[]);
    // too little to begin with: the kernel takes the worker away
    let command = [
        "solve",
        SCENE,
        "--out",
        "none",
        "--workers",
        "2",
        "--memory",
        "0.06",
    ];
    let output = desk.run(&command);
    assert!(!output.status.success());
    assert!(!desk.path("none").exists());
}
