//! Logs that cannot be written, and terminals that take nothing: what is computed does not depend on them.

use std::fs::File;
use std::io::pipe;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, nestrad, program, said, signal, until, wait_for};

/// A stderr that takes nothing, and what must be kept for that.
fn full() -> (Stdio, Option<File>) {
    let disk = File::options().write(true).open("/dev/full").unwrap();
    (disk.into(), None)
}

fn without_reader() -> (Stdio, Option<File>) {
    let (reader, writer) = pipe().unwrap();
    drop(reader);
    (writer.into(), None)
}

fn of_a_reader_that_does_not_read() -> (Stdio, Option<File>) {
    let (reader, writer) = pipe().unwrap();
    let reader: std::os::fd::OwnedFd = reader.into();
    (writer.into(), Some(reader.into()))
}

/// Solves at a master, then with a worker, which both have no log; the bytes are the same, and both end when told to.
fn solves_without(log: impl Fn() -> (Stdio, Option<File>)) -> f64 {
    let desk = Desk::new();
    let (stderr, _kept) = log();
    let master =
        Master::start_without_log(stderr, &["--state", desk.path("state").to_str().unwrap()]);
    desk.compare("scene.toml", &[], &master);
    let (stderr, _kept) = log();
    let mut worker = Command::new(program("nestrad-worker"));
    worker
        .args(["--master", &master.url(), "--threads", "1"])
        .env("RUST_LOG", "trace")
        .stderr(stderr);
    let worker = worker.spawn().unwrap();
    until("a worker joins", || master.metric("nestrad_workers") > 0.0);
    desk.compare("scene.toml", &["--seed", "2"], &master);
    let results = master.metric("nestrad_worker_results_total");
    assert!(results > 0.0);
    let dropped = master.metric("nestrad_log_lines_dropped_total");
    let begun = Instant::now();
    signal(worker.id(), "TERM");
    assert_eq!(wait_for(worker).status.code(), Some(0));
    assert_eq!(master.terminate().code(), Some(0));
    assert!(begun.elapsed() < Duration::from_secs(20), "{begun:?}");
    dropped
}

#[test]
fn a_log_on_a_full_disk_stops_neither_master_nor_worker() {
    assert!(solves_without(full) > 0.0);
}

#[test]
fn a_log_whose_reader_is_gone_stops_neither_master_nor_worker() {
    assert!(solves_without(without_reader) > 0.0);
}

#[test]
fn a_log_that_nobody_reads_holds_up_neither_master_nor_worker() {
    solves_without(of_a_reader_that_does_not_read);
}

#[test]
fn a_solve_whose_words_cannot_be_said_has_its_results() {
    let desk = Desk::new();
    desk.done(&["solve", "scene.toml", "--out", "here"]);
    for log in [full, without_reader] {
        let mut solve = nestrad(desk.folder(), &["solve", "scene.toml", "--out", "there"]);
        solve.stdout(log().0).stderr(log().0);
        assert!(wait_for(solve.spawn().unwrap()).status.success());
        assert!(desk.tables("here") == desk.tables("there"));
        std::fs::remove_dir_all(desk.path("there")).unwrap();
    }
    // where only the table cannot be shown, that is said
    let mut solve = nestrad(desk.folder(), &["solve", "scene.toml", "--out", "there"]);
    solve.stdout(full().0);
    let output = wait_for(solve.spawn().unwrap());
    assert!(output.status.success());
    assert!(
        said(&output).contains("the table is not shown"),
        "{}",
        said(&output)
    );
    // what is asked for on stdout and cannot be written there is an error
    let mut check = nestrad(desk.folder(), &["check", "scene.toml"]);
    check.stdout(full().0);
    assert!(!wait_for(check.spawn().unwrap()).status.success());
}

#[test]
fn names_of_files_and_bands_do_not_steer_the_terminal() {
    let desk = Desk::new();
    let scene = std::fs::read_to_string(desk.path("scene.toml")).unwrap();
    let steering = scene.replace("\"NIR\"", "\"N\\u001b[2J\\u202e\"");
    std::fs::write(desk.path("steers.toml"), steering).unwrap();
    for args in [
        &["solve", "steers.toml", "--out", "out"][..],
        &["check", "steers.toml"],
        &[
            "solve",
            "no\u{1b}[2J\nresults are in out.toml",
            "--out",
            "out",
        ],
        &["solve", "scene.toml", "--out", "out", "--\u{202e}x"],
        &["status", "--master", "http://\u{1b}[2J:1"],
    ] {
        let output = desk.run(args);
        let text = [&output.stdout[..], &output.stderr[..]].concat();
        let text = String::from_utf8(text).unwrap();
        assert!(!text.contains(['\u{1b}', '\u{202e}']), "{args:?}: {text}");
        assert!(!text.contains("\nresults"), "{args:?}: {text}");
        assert!(text.contains("\\u{"), "{args:?}: {text}");
    }
}
