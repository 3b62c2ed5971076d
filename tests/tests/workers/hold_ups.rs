//! A worker that does less than it says holds up no others, and no master.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use nestrad_proto::v1::{JoinRequest, RowsHeader};
use nestrad_tests::crew::{Solving, worker};
use nestrad_tests::rogue::{Rogue, honest_join};

use super::{SCENE, maize};

/// As long as a solve may take that somebody tries to hold up: a few seconds, and much for a machine that is busy.
const IN_TIME: Duration = Duration::from_secs(45);

/// Renews the leases of a rogue until a solve has ended, which must be a good end.
fn succeeds_while_it_renews(solving: &mut Solving, rogue: &Rogue, leases: &[u64]) {
    let over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            while !over.load(Ordering::Relaxed) && rogue.renew(leases.to_vec()).is_ok() {
                thread::sleep(Duration::from_millis(100));
            }
        });
        let begun = Instant::now();
        solving.succeeds();
        over.store(true, Ordering::Relaxed);
        assert!(begun.elapsed() < IN_TIME, "{:?}", begun.elapsed());
    });
}

#[test]
fn a_worker_that_only_renews_does_not_keep_the_master_from_computing() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &["--patience", "1"]);
    let rogue = Rogue::join(solving.address);
    let leases = [(); 8].map(|()| rogue.lease().lease_id);
    succeeds_while_it_renews(&mut solving, &rogue, &leases);
    let log = solving.process.log();
    assert!(
        log.contains("workers brought next to nothing for 1 s"),
        "{log}"
    );
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_result_that_took_for_ever_does_not_keep_a_held_job_from_others() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    let rogue = Rogue::join(solving.address);
    let (first, held) = (rogue.lease(), rogue.lease());
    let (mut header, packed) = rogue.compute(&first);
    header.compute_s = 1e300;
    assert!(rogue.bring(&header, &packed).unwrap());
    let _good = worker(solving.address, &[]);
    succeeds_while_it_renews(&mut solving, &rogue, &[held.lease_id]);
    assert!(expected == desk.tables("there"));
}

#[test]
fn large_promises_that_come_by_drops_block_no_result() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    let request = JoinRequest {
        threads: 16,
        ..honest_join()
    };
    let rogue = Rogue::join_as(solving.address, request).unwrap();
    let jobs = [(); 16].map(|()| rogue.lease());
    let (fair, _) = rogue.compute(&jobs[0]);
    // a half of the room at once, and sixteenths of it
    for (job, parts) in jobs.iter().zip([2].into_iter().chain([16; 15])) {
        let promised = (1 << 30) / parts;
        rogue.drip(RowsHeader {
            lease_id: job.lease_id,
            packed_bytes: promised,
            entries: promised,
            ..fair.clone()
        });
    }
    let _good = worker(solving.address, &[]);
    let leases = jobs.map(|job| job.lease_id);
    succeeds_while_it_renews(&mut solving, &rogue, &leases);
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_worker_that_fails_leaves_and_comes_again_fails_no_job() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    for time in 0..20 {
        // under one name, and then under many
        let name = format!("rogue {}", time / 10 * time);
        let request = JoinRequest {
            name,
            ..honest_join()
        };
        let rogue = Rogue::join_as(solving.address, request).unwrap();
        rogue.fail(&rogue.lease(), "out of paper");
        rogue.leave();
    }
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}
