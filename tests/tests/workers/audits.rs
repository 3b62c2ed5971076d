//! Workers that lie: what can be seen in their rows is refused, the rest is found out by computing it again.

use std::thread;

use nestrad_proto::v1::RowsHeader;
use nestrad_tests::crew::{Solving, worker};
use nestrad_tests::desk::Desk;
use nestrad_tests::lies::Pairs;
use nestrad_tests::processes::Master;
use nestrad_tests::rogue::{Rogue, honest_join};
use tonic::{Code, Status};

use super::{SCENE, maize};

type Lie = fn(&mut Pairs);

/// Serves in a thread of its own, with a lie about jobs of these numbers.
fn liar(rogue: Rogue, lie: Lie, about: fn(usize) -> bool) -> thread::JoinHandle<usize> {
    thread::spawn(move || {
        rogue.serve(|k, pairs| {
            if about(k) {
                lie(pairs);
            }
        })
    })
}

/// Brings a job with so small a lie that only bits tell.
fn brings_a_small_lie(rogue: &Rogue) -> Result<bool, Status> {
    let (header, packed) = rogue.lie(&rogue.lease(), Pairs::swap_two)?;
    rogue.bring(&header, &packed)
}

#[test]
fn rows_that_are_scaled_or_left_out_are_refused_at_once() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    let lies: [(&str, Lie); 2] = [("scaled", Pairs::scale), ("left out", Pairs::drop_half)];
    for (what, lie) in lies {
        let rogue = Rogue::join(solving.address);
        let (header, packed) = rogue.lie(&rogue.lease(), lie).unwrap();
        let refused = rogue.bring(&header, &packed).unwrap_err();
        assert_eq!(refused.code(), Code::InvalidArgument, "{what}: {refused:?}");
    }
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

/// 128 MiB of ones and zeros can be 350 million entries, and take the master 4 GiB.
#[test]
fn a_result_with_more_entries_than_its_lines_can_give_takes_no_memory() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &["--memory", "1"]);
    // made before it joins: who is silent for long is forgotten
    let packed = vec![0xff; 128 << 20];
    let checksum = blake3::hash(&packed).as_bytes().to_vec();
    let rogue = Rogue::join(solving.address);
    let (honest, _) = rogue.compute(&rogue.lease());
    let header = RowsHeader {
        packed_bytes: packed.len() as u64,
        entries: 2 * (packed.len() as u64 * 8 / 6),
        checksum,
        ..honest
    };
    let refused = rogue.bring(&header, &packed).unwrap_err();
    assert_eq!(refused.code(), Code::InvalidArgument, "{refused:?}");
    let peak = solving.process.peak_bytes().unwrap();
    assert!(peak < 256 << 20, "{peak} bytes");
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn ends_that_are_swapped_are_seen_where_lines_are_traced_again() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &["--audit", "1"]);
    let rogue = Rogue::join(solving.address);
    let (header, packed) = rogue.lie(&rogue.lease(), Pairs::swap).unwrap();
    let refused = rogue.bring(&header, &packed).unwrap_err();
    assert_eq!(refused.code(), Code::FailedPrecondition, "{refused:?}");
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_worker_whose_valid_rows_are_wrong_is_found_out_and_all_is_done_anew() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    let rogue = Rogue::join(solving.address);
    // taken, but where it is looked at these two by chance
    let _ = brings_a_small_lie(&rogue);
    let lying = liar(rogue, Pairs::swap_two, |_| true);
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    lying.join().unwrap();
    assert!(expected == desk.tables("there"));
    let log = solving.process.log();
    assert!(
        log.contains("rogue at 127.0.0.1 returned wrong rows"),
        "{log}"
    );
}

#[test]
fn a_worker_that_lies_in_one_job_of_ten_is_found_out() {
    let fine = ["--accuracy", "0.3"];
    let (desk, expected) = maize(&fine);
    // all audited, so that it does not depend on chance
    let audited = [&fine[..], &["--audit", "1"]].concat();
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &audited);
    let rogue = Rogue::join(solving.address);
    let taken = rogue.serve(|k, pairs| {
        if k % 10 == 9 {
            pairs.swap_two();
        }
    });
    assert!((9..20).contains(&taken), "{taken} jobs of the liar");
    let mut good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(good.ends().success(), "{}", good.log());
    assert!(expected == desk.tables("there"));
}

#[test]
fn after_three_liars_the_master_computes_alone() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &["--audit", "1"]);
    for name in ["a", "b", "c"] {
        let mut request = honest_join();
        request.name = name.to_owned();
        let rogue = Rogue::join_as(solving.address, request).unwrap();
        rogue.serve(|_, pairs| pairs.swap());
    }
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn who_was_wrong_is_refused_counted_and_shown() {
    let (desk, expected) = maize(&[]);
    let master = Master::start(&["--audit", "1"]);
    let url = master.url();
    let rogue = Rogue::join(master.address);
    let lying = liar(rogue, Pairs::swap, |_| true);
    let _good = worker(master.address, &[]);
    desk.done(&["solve", SCENE, "--out", "there", "--master", &url]);
    assert!(expected == desk.tables("there"));
    // its calls are those of a stranger, and it does not come in again
    lying.join().unwrap();
    let refused = Rogue::join_as(master.address, honest_join()).err().unwrap();
    assert_eq!(refused.code(), Code::FailedPrecondition, "{refused:?}");
    assert!(master.metric("nestrad_jobs_audited_total") >= 2.0);
    assert_eq!(master.metric("nestrad_workers_untrusted"), 1.0);
    let status = desk.done(&["status", "--master", &url]).stdout;
    let status = String::from_utf8(status).unwrap();
    assert!(
        status.contains("rogue at 127.0.0.1: it returned wrong rows"),
        "{status}"
    );
    assert!(master.log().contains("returned wrong rows"));
}

#[test]
fn kept_rows_of_a_worker_that_is_found_out_are_dropped() {
    let (desk, expected) = maize(&[]);
    let state = ["--state", "state"];
    let solve = |out: &str, more: &[&str], lies: usize| {
        let args = [&state[..], more].concat();
        let mut solving = Solving::begin(desk.folder(), SCENE, out, &args);
        let rogue = Rogue::join(solving.address);
        for _ in 0..lies {
            let taken = brings_a_small_lie(&rogue);
            assert!(taken.is_ok() || more.contains(&"2"), "{taken:?}");
        }
        drop(rogue);
        let _good = worker(solving.address, &[]);
        solving.succeeds();
        desk.tables(out)
    };
    // who does not audit believes
    assert!(expected != solve("believed", &["--audit", "0"], 2));
    // it is found out with other lines, and its earlier rows go with it
    solve("other", &["--seed", "2"], 1);
    desk.done(&[&["solve", SCENE, "--out", "again"], &state[..]].concat());
    assert!(expected == desk.tables("again"));
    assert_eq!(traced(&desk, "again"), 2);
}

fn traced(desk: &Desk, out: &str) -> u64 {
    let summary = std::fs::read(desk.path(out).join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
    summary["counters"]["jobs"]["traced"].as_u64().unwrap()
}
