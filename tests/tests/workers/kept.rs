use std::fs;
use std::os::unix::fs::FileExt;
use std::process::Command;

use nestrad_tests::crew::{Solving, worker};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, finish, program, said, until};
use nestrad_tests::rogue::Rogue;

use super::{SCENE, maize};

/// Jobs of a solve that were traced, and that were kept.
fn jobs(desk: &Desk, out: &str) -> [u64; 2] {
    let summary = fs::read(desk.path(out).join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    ["traced", "kept"].map(|name| summary["counters"]["jobs"][name].as_u64().unwrap())
}

fn solve(desk: &Desk, out: &str, more: &[&str]) -> [Vec<u8>; 3] {
    let args = ["solve", SCENE, "--state", "state", "--out", out];
    desk.done(&[&args, more].concat());
    desk.tables(out)
}

#[test]
fn other_lights_on_the_same_geometry_trace_nothing() {
    let (desk, expected) = maize(&[]);
    assert!(expected == solve(&desk, "first", &[]));
    let [traced, kept] = jobs(&desk, "first");
    assert!(traced > 0 && kept == 0);
    let sun = ["--light", "day.light"];
    let args = ["solve", SCENE, "--out", "plain"];
    desk.done(&[&args, &sun[..]].concat());
    for (out, more) in [("here", &[][..]), ("there", &["--workers", "2"])] {
        let tables = solve(&desk, out, &[&sun, more].concat());
        assert!(desk.tables("plain") == tables, "{out}");
        assert_eq!(jobs(&desk, out), [0, traced], "{out}");
    }
    // another seed has other lines
    solve(&desk, "other", &["--seed", "2"]);
    assert_eq!(jobs(&desk, "other"), [traced, 0]);
}

#[test]
fn a_master_that_was_killed_computes_only_what_was_not_finished() {
    let (desk, expected) = maize(&[]);
    let state = ["--state", "state"];
    let killed = Solving::begin(desk.folder(), SCENE, "none", &state);
    let file = desk.path("state/results.redb");
    let begun = fs::metadata(&file).unwrap().modified().unwrap();
    let rogue = Rogue::join(killed.address);
    let mut brought = 0;
    until("a result is written", || {
        let (header, packed) = rogue.compute(&rogue.lease());
        assert!(rogue.bring(&header, &packed).unwrap());
        brought += 1;
        brought > 2 && fs::metadata(&file).unwrap().modified().unwrap() > begun
    });
    killed.process.signal("KILL");
    drop(killed);
    assert!(expected == solve(&desk, "again", &[]));
    let [traced, kept] = jobs(&desk, "again");
    assert!(kept > 0 && kept <= brought && traced > 0, "{traced} {kept}");
    assert!(!desk.path("none").exists());
}

#[test]
fn a_file_that_is_damaged_costs_time_and_nothing_else() {
    let (desk, expected) = maize(&[]);
    solve(&desk, "first", &[]);
    let path = desk.path("state/results.redb");
    let length = fs::metadata(&path).unwrap().len();
    let file = fs::File::options().write(true).open(&path).unwrap();
    for at in (8192..length).step_by(50_000) {
        file.write_all_at(&[0x5a; 64], at).unwrap();
    }
    drop(file);
    assert!(expected == solve(&desk, "second", &[]));
    assert!(jobs(&desk, "second")[0] > 0, "damage was not seen");
    fs::write(&path, b"this is no database").unwrap();
    let args = ["solve", SCENE, "--state", "state", "--out", "third"];
    let output = desk.done(&args);
    assert!(
        said(&output).contains("the file is renamed to"),
        "{}",
        said(&output)
    );
    assert!(expected == desk.tables("third"));
}

#[test]
fn a_full_disk_is_said_and_the_solve_goes_on() {
    let (desk, expected) = maize(&[]);
    // no file may grow beyond 4 MiB: the tables do not, the results do
    let limited = "trap '' XFSZ; ulimit -f 4096; exec \"$0\" \"$@\"";
    let mut command = Command::new("bash");
    command
        .args(["-c", limited])
        .arg(program("nestrad"))
        .args(["solve", SCENE, "--state", "state", "--out", "there"])
        .current_dir(desk.folder())
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped());
    let output = finish(command);
    assert!(output.status.success(), "{}", said(&output));
    let said = said(&output);
    assert!(said.contains("results are no longer kept"), "{said}");
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_state_that_cannot_be_written_at_the_start_is_said_and_the_solve_goes_on() {
    let desk = Desk::new();
    desk.done(&["solve", "scene.toml", "--out", "here"]);
    let expected = desk.tables("here");
    std::fs::create_dir(desk.path("device")).unwrap();
    std::os::unix::fs::symlink("/dev/full", desk.path("device/results.redb")).unwrap();
    // no folder can be made; a file that takes nothing; no file may be as large as an empty store
    for (state, limit) in [
        ("/proc/state", "unlimited"),
        ("device", "unlimited"),
        ("state", "512"),
    ] {
        let limited = format!("trap '' XFSZ; ulimit -f {limit}; exec \"$0\" \"$@\"");
        let mut command = Command::new("bash");
        command
            .args(["-c", &limited])
            .arg(program("nestrad"))
            .args(["solve", "scene.toml", "--state", state, "--out", "there"])
            .current_dir(desk.folder())
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped());
        let output = finish(command);
        assert!(output.status.success(), "{}", said(&output));
        let said = said(&output);
        assert!(said.contains("no results are kept"), "{state}: {said}");
        assert!(expected == desk.tables("there"));
    }
    // a device is no file that one puts aside
    assert!(desk.path("device/results.redb").is_symlink());
    let file = desk.run(&[
        "solve",
        "scene.toml",
        "--state",
        "scene.toml",
        "--out",
        "there",
    ]);
    assert!(said(&file).contains("expected a folder"), "{}", said(&file));
    let master = Master::start(&["--state", "/proc/state"]);
    assert!(
        master.log().contains("no results are kept"),
        "{}",
        master.log()
    );
}

#[test]
fn a_damaged_state_costs_time_and_shows_no_panic() {
    let desk = Desk::new();
    desk.done(&["solve", "scene.toml", "--out", "here"]);
    let expected = desk.tables("here");
    let args = ["solve", "scene.toml", "--state", "state", "--out", "there"];
    desk.done(&args);
    let path = desk.path("state/results.redb");
    let whole = std::fs::read(&path).unwrap();
    let pages = whole.len() / 4096;
    for case in 0..8 {
        let mut bytes = whole.clone();
        match case {
            0 => bytes.truncate(whole.len() / 2),
            1 => bytes.truncate(5000),
            2 => bytes[..320].fill(0xff),
            // pages here and there, and all that is left of another file
            _ => (case..pages).step_by(case).for_each(|page| {
                bytes[4096 * page + 8 * case..][..64].fill(0x5a);
            }),
        }
        std::fs::write(&path, bytes).unwrap();
        let output = desk.done(&args);
        assert!(
            !said(&output).contains("panicked"),
            "{case}: {}",
            said(&output)
        );
        assert!(expected == desk.tables("there"), "{case}");
    }
}

#[test]
fn workers_fill_what_is_missing() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &["--state", "state"]);
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
    assert!(expected == solve(&desk, "again", &[]));
    assert_eq!(jobs(&desk, "again")[0], 0);
}
