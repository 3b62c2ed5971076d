use nestrad_proto::v1::{JoinRequest, RowsHeader, return_rows_request};
use nestrad_tests::crew::{Solving, worker};
use nestrad_tests::rogue::{Rogue, honest_join};
use tonic::Code;

use super::{SCENE, maize};

/// A result that is not what it should be, made from a good one.
type Spoil = fn(&mut RowsHeader, &mut Vec<u8>);

const SPOILT: [(&str, Spoil); 9] = [
    ("garbage", |_, packed| packed.fill(0xff)),
    ("garbage with its checksum", |header, packed| {
        packed.fill(0xff);
        header.checksum = blake3::hash(packed).as_bytes().to_vec();
    }),
    ("a row that there is not", |header, packed| {
        // a gamma code of many zeros
        let n = packed.len();
        packed[n - 8..n - 5].fill(0);
        header.checksum = blake3::hash(packed).as_bytes().to_vec();
    }),
    ("too few bytes", |_, packed| packed.truncate(100)),
    ("too many bytes", |_, packed| packed.extend([0; 100])),
    ("too many rows", |header, _| header.rows += 1),
    ("too many entries", |header, _| header.entries += 1),
    ("another checksum", |header, _| header.checksum[0] ^= 1),
    ("more bytes than fit the machine", |header, _| {
        header.packed_bytes = u64::MAX;
        header.entries = u64::MAX / 8;
    }),
];

#[test]
fn results_that_are_wrong_are_refused_and_computed_anew() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    for (what, spoil) in SPOILT {
        // each is a worker of its own: none is trusted with a job twice failed
        let rogue = Rogue::join(solving.address);
        let job = rogue.lease();
        let (mut header, mut packed) = rogue.compute(&job);
        spoil(&mut header, &mut packed);
        let refused = rogue.bring(&header, &packed).unwrap_err();
        let expected = [Code::InvalidArgument, Code::DataLoss];
        assert!(expected.contains(&refused.code()), "{what}: {refused:?}");
        // the lease is gone with it
        assert_eq!(rogue.renew(vec![job.lease_id]).unwrap(), [job.lease_id]);
        // what it brings as it should is taken
        let (header, packed) = rogue.compute(&rogue.lease());
        assert!(rogue.bring(&header, &packed).unwrap(), "after {what}");
    }
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_time_that_is_no_number_does_not_matter() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    let rogue = Rogue::join(solving.address);
    for compute_s in [f64::NAN, f64::INFINITY, -1.0] {
        let (mut header, packed) = rogue.compute(&rogue.lease());
        header.compute_s = compute_s;
        assert!(rogue.bring(&header, &packed).unwrap());
    }
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_result_counts_once_and_only_while_it_is_wanted() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    let rogue = Rogue::join(solving.address);
    let job = rogue.lease();
    let (header, packed) = rogue.compute(&job);
    assert!(rogue.bring(&header, &packed).unwrap());
    assert!(!rogue.bring(&header, &packed).unwrap(), "taken twice");
    // a lease that was never given
    let made_up = RowsHeader {
        lease_id: job.lease_id ^ 0xffff,
        ..header.clone()
    };
    assert!(!rogue.bring(&made_up, &packed).unwrap());
    // somebody else's
    let other = Rogue::join(solving.address);
    let theirs = other.lease();
    let stolen = RowsHeader {
        lease_id: theirs.lease_id,
        ..header.clone()
    };
    assert_eq!(
        rogue.bring(&stolen, &packed).unwrap_err().code(),
        Code::PermissionDenied
    );
    // a worker that never joined
    let stranger = RowsHeader {
        worker_id: 7,
        ..header
    };
    assert_eq!(
        rogue.bring(&stranger, &packed).unwrap_err().code(),
        Code::NotFound
    );
    // a stale lease: the job is done by another before its result comes
    let (late, late_packed) = other.compute(&theirs);
    let good = worker(solving.address, &[]);
    good.says("joined");
    loop {
        match other.renew(vec![theirs.lease_id]) {
            Ok(unwanted) if unwanted.is_empty() => {
                std::thread::sleep(std::time::Duration::from_millis(20));
            }
            // done by the good one, or forgotten with the solve
            _ => break,
        }
        if other.bring(&late, &late_packed).is_ok() {
            break;
        }
    }
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}

#[test]
fn a_job_that_fails_on_every_worker_is_done_by_the_master() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &["--patience", "1"]);
    let rogue = Rogue::join(solving.address);
    rogue.fail(&rogue.lease(), "out of paper");
    rogue.fail(&rogue.lease(), "out of paper again\u{1b}[2J");
    solving.succeeds();
    let log = solving.process.log();
    assert!(
        log.contains("out of paper again?[2J: the master computes it"),
        "{log}"
    );
    assert!(expected == desk.tables("there"));
}

#[test]
fn who_cannot_serve_is_turned_away() {
    let (desk, _) = maize(&[]);
    let solving = Solving::begin(desk.folder(), SCENE, "none", &[]);
    type Spoil = fn(&mut JoinRequest);
    let wrong: [(Code, Spoil); 4] = [
        (Code::FailedPrecondition, |j| j.kernel = "other".to_owned()),
        (Code::InvalidArgument, |j| j.threads = 0),
        (Code::InvalidArgument, |j| j.threads = 1 << 20),
        (Code::InvalidArgument, |j| j.name = "x".repeat(1000)),
    ];
    for (code, spoil) in wrong {
        let mut request = honest_join();
        spoil(&mut request);
        let refused = Rogue::join_as(solving.address, request).err().unwrap();
        assert_eq!(refused.code(), code, "{refused:?}");
    }
}

#[test]
fn a_result_without_header_or_with_two_is_refused() {
    let (desk, expected) = maize(&[]);
    let mut solving = Solving::begin(desk.folder(), SCENE, "there", &[]);
    let rogue = Rogue::join(solving.address);
    let chunk = return_rows_request::Part::Chunk(vec![1; 100].into());
    assert_eq!(
        rogue.send(vec![chunk]).unwrap_err().code(),
        Code::InvalidArgument
    );
    assert_eq!(
        rogue.send(vec![]).unwrap_err().code(),
        Code::InvalidArgument
    );
    let (header, _) = rogue.compute(&rogue.lease());
    let header = return_rows_request::Part::Header(header);
    let twice = rogue.send(vec![header.clone(), header]).unwrap_err();
    assert_eq!(twice.code(), Code::InvalidArgument);
    let _good = worker(solving.address, &[]);
    solving.succeeds();
    assert!(expected == desk.tables("there"));
}
