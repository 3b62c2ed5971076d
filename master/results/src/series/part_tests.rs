use std::fs;

use nestrad_engine::solution::{Balance, Estimate};
use proptest::prelude::*;

use super::*;

fn step(seed: f64) -> StepResult {
    let organ = |value: f64| OrganStep {
        absorbed_W: value / 3.0,
        absorbed_direct_W: value / 7.0,
        absorbed_se_W: 1e-300,
        absorbed_bias_W: 0.1 + 0.2,
    };
    StepResult {
        organs: vec![organ(seed), organ(-seed)],
        facts: StepFacts {
            balance: vec![Balance {
                band: "PAR".into(),
                incoming_W: seed / 9.0,
                closure_W: Estimate {
                    value: 1e-17 * seed,
                    se: f64::MIN_POSITIVE,
                },
                ..Balance::default()
            }],
            error_percent: Some(seed / 11.0),
        },
    }
}

fn done(out: &Path, key: u8) -> Vec<(usize, StepResult)> {
    Part::open(out, [key; KEY]).expect("opened").1
}

#[test]
fn moments_come_back_to_the_last_bit() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let (mut part, before) = Part::open(&out, [1; KEY]).expect("opened");
    assert!(before.is_empty());
    part.add(3, &step(1.0)).expect("kept");
    part.add(4, &step(2.0)).expect("kept");
    // another process waits its turn
    assert!(matches!(
        Part::open(&out, [1; KEY]),
        Err(PartError::InUse { .. })
    ));
    drop(part);
    assert_eq!(done(&out, 1), [(3, step(1.0)), (4, step(2.0))]);
    // other inputs are another series
    assert!(done(&out, 2).is_empty());
    Part::open(&out, [1; KEY])
        .expect("opened")
        .0
        .remove()
        .expect("removed");
    assert!(done(&out, 1).is_empty());
}

#[test]
fn a_record_that_is_cut_or_garbled_is_forgotten_with_all_after_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let (mut part, _) = Part::open(&out, [1; KEY]).expect("opened");
    part.add(0, &step(1.0)).expect("kept");
    let path = part.path().to_owned();
    let first = fs::metadata(&path).expect("there").len() as usize;
    part.add(1, &step(2.0)).expect("kept");
    drop(part);
    let whole = fs::read(&path).expect("read");
    for cut in [first + 1, first + HEAD, whole.len() - 1] {
        fs::write(&path, &whole[..cut]).expect("written");
        assert_eq!(done(&out, 1), [(0, step(1.0))], "{cut}");
        assert_eq!(fs::metadata(&path).expect("there").len() as usize, first);
    }
    for at in [first, first + 9, first + HEAD + 3, whole.len() - 1] {
        let mut garbled = whole.clone();
        garbled[at] ^= 0x40;
        fs::write(&path, &garbled).expect("written");
        assert_eq!(done(&out, 1), [(0, step(1.0))], "{at}");
    }
    // what is written after that is found
    let (mut part, _) = Part::open(&out, [1; KEY]).expect("opened");
    part.add(7, &step(3.0)).expect("kept");
    drop(part);
    assert_eq!(done(&out, 1), [(0, step(1.0)), (7, step(3.0))]);
}

#[test]
fn the_file_stands_beside_the_result() {
    for out in ["a/out", "a/out/", "a/out/."] {
        let found = place(Path::new(out), &[0xab; KEY]);
        assert_eq!(found, Path::new("a/out.series-abababababababab"));
    }
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("out");
        let path = place(&out, &[1; KEY]);
        fs::write(&path, [NAME, &[1; KEY], &bytes].concat()).expect("written");
        prop_assert!(done(&out, 1).is_empty());
    }
}
