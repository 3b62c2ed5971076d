//! A master whom nobody helps goes on by itself.

use std::time::{Duration, Instant};

use nestrad_tests::crew::{Solving, worker};

use super::{SCENE, maize};

#[test]
fn a_solve_that_nobody_joins_is_computed_by_the_master() {
    let (desk, expected) = maize(&[]);
    let patience = ["--patience", "1"];
    Solving::begin(desk.folder(), SCENE, "there", &patience).succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_solve_whose_workers_are_gone_for_good_is_ended_by_the_master() {
    // long enough for a worker to fail in
    let fine = ["--accuracy", "0.3"];
    let (desk, expected) = maize(&fine);
    let impatient = [&fine[..], &["--patience", "1"]].concat();
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &impatient);
    let mut victim = worker(solving.address, &[]);
    victim.says("block is ready");
    victim.signal("KILL");
    victim.ends();
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_solve_that_is_all_kept_waits_for_nobody() {
    let (desk, expected) = maize(&[]);
    let state = ["--state", "state"];
    desk.done(&[&["solve", SCENE, "--out", "first"], &state[..]].concat());
    let begun = Instant::now();
    Solving::begin(desk.folder(), SCENE, "there", &state).succeeds();
    // patience is a minute
    assert!(begun.elapsed() < Duration::from_secs(45));
    assert!(expected == desk.tables("there"));
}
