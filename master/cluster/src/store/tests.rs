use std::fs;
use std::os::unix::fs::FileExt;

use nestrad_kernel::packed::{self, Shape};
use nestrad_kernel::rows::Counts;

use super::*;

const SHAPE: Shape = Shape {
    rows: 10_000,
    ends: 250,
};

/// Rows that see one end each, packed.
fn rows(count: u32, end: u8) -> Arc<PackedRows> {
    let mut packer = packed::Packer::new(SHAPE.ends as usize);
    (0..count).for_each(|row| packer.single(row, u32::from(end)));
    let counts = Counts {
        lines: 7,
        row_entries: packer.entries(),
        ..Counts::default()
    };
    Arc::new(PackedRows {
        counts,
        packed: packer.finish(),
    })
}

fn get(store: &Store, name: u8) -> Option<Arc<PackedRows>> {
    store.get(&[name; 32]).map(Arc::new)
}

#[test]
fn what_was_put_is_there_after_reopening() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    store.put([1; 32], &rows(100, 9), None);
    drop(store);
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    assert_eq!(get(&store, 1), Some(rows(100, 9)));
    assert_eq!(get(&store, 2), None);
    assert_eq!(store.warning(), None);
}

fn length(folder: &Path) -> u64 {
    fs::metadata(folder.join("results.redb")).unwrap().len()
}

fn name(k: u32) -> Key {
    let mut name = [0; 32];
    name[..4].copy_from_slice(&k.to_le_bytes());
    name
}

#[test]
fn the_file_is_never_larger_than_it_may_be() {
    let folder = tempfile::tempdir().unwrap();
    let most = 16 << 20;
    let store = Store::open(folder.path(), most).unwrap();
    let mut longest = 0;
    // of all sizes, many times what fits
    for k in 0..3000u32 {
        store.put(
            name(k),
            &rows(100 + k * 7_919 % 9_800, (k % 250) as u8),
            None,
        );
        longest = length(folder.path()).max(longest);
    }
    store.close();
    assert_eq!(store.warning(), None);
    longest = length(folder.path()).max(longest);
    assert!(longest <= most, "{longest} bytes");
    assert!(
        store.bytes() > most / 16,
        "{} bytes are kept",
        store.bytes()
    );
    drop(store);
    // it is to be smaller now
    let store = Store::open(folder.path(), most / 2).unwrap();
    assert!(length(folder.path()) <= most / 2);
    assert!(store.bytes() > 0);
}

#[test]
fn the_oldest_go_first_when_it_is_full() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 4 << 20).unwrap();
    for k in 0..400 {
        store.put(name(k), &rows(9_999, 3), None);
    }
    store.close();
    let kept = |k: u32| store.get(&name(k)).is_some();
    let first = (0..400).find(|&k| kept(k)).unwrap();
    assert!(
        (1..400).contains(&first) && (first..400).all(kept),
        "{first}"
    );
}

#[test]
fn a_result_larger_than_the_store_is_not_kept() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 20_000).unwrap();
    store.put([2; 32], &rows(9_999, 2), None);
    store.close();
    assert_eq!(get(&store, 2), None);
    assert_eq!(store.warning(), None);
}

#[test]
fn two_masters_do_not_share_a_store() {
    let folder = tempfile::tempdir().unwrap();
    let _first = Store::open(folder.path(), 1 << 20).unwrap();
    let second = Store::open(folder.path(), 1 << 20).err().unwrap();
    assert!(second.to_string().contains("in use"), "{second}");
}

#[test]
fn a_file_that_is_no_store_is_put_aside() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("results.redb"), [7; 9000]).unwrap();
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    let warning = store.warning().unwrap();
    assert!(warning.contains("the file is renamed to"), "{warning}");
    store.put([1; 32], &rows(10, 1), None);
    store.close();
    assert_eq!(get(&store, 1), Some(rows(10, 1)));
}

#[test]
fn a_broken_result_is_not_taken() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    store.put([1; 32], &rows(5_000, 249), None);
    drop(store);
    let path = folder.path().join("results.redb");
    let bytes = fs::read(&path).unwrap();
    // a row further on, its end no less than the largest: all bytes are alike
    let packed = &rows(5_000, 249).packed[100..164];
    let at = bytes.windows(64).position(|w| w == packed).unwrap();
    let file = fs::File::options().write(true).open(&path).unwrap();
    file.write_all_at(&[!packed[10]], at as u64 + 10).unwrap();
    drop(file);
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    assert_eq!(get(&store, 1), None);
    // it is computed anew, and kept
    store.put([1; 32], &rows(5_000, 249), None);
    store.close();
    assert_eq!(get(&store, 1), Some(rows(5_000, 249)));
}

#[test]
fn results_of_a_worker_that_was_wrong_are_gone_and_those_of_others_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    let by = |worker: &str| {
        let worker = worker.into();
        let audited = false;
        Some(Origin { worker, audited })
    };
    store.put([1; 32], &rows(100, 1), by("liar"));
    store.put([2; 32], &rows(100, 2), by("other"));
    store.put([3; 32], &rows(100, 3), None);
    store.audited([2; 32]);
    store.put([4; 32], &rows(100, 4), by("liar"));
    // from now on, written or not
    store.drop_of("liar");
    assert_eq!((get(&store, 1), get(&store, 4)), (None, None));
    store.close();
    drop(store);
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    let kept = [1, 2, 3, 4].map(|name| get(&store, name).is_some());
    assert_eq!(kept, [false, true, true, false]);
    assert_eq!(store.bytes(), 2 * (64 + rows(100, 2).packed.len() as u64));
    let origin = store.origin(&[2; 32]).unwrap();
    assert_eq!((&*origin.worker, origin.audited), ("other", true));
    assert_eq!(store.origin(&[3; 32]), None);
    // it may be right in another solve
    store.put([1; 32], &rows(100, 1), None);
    store.close();
    assert_eq!(get(&store, 1), Some(rows(100, 1)));
}
