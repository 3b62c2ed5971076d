use std::fs;
use std::os::unix::fs::FileExt;

use bytes::Bytes;

use super::*;
use crate::exchange::Traced;

const SHAPE: Shape = Shape {
    rows: 10_000,
    ends: 250,
};

/// Rows that see one end each, packed.
fn rows(count: u32, end: u8) -> JobRows {
    let mut packer = packed::Packer::new(SHAPE.ends as usize);
    (0..count).for_each(|row| packer.single(row, u32::from(end)));
    JobRows {
        traced: Traced {
            lines: 7,
            row_entries: packer.entries(),
            ..Traced::default()
        },
        packed: Bytes::from(packer.finish()),
    }
}

fn get(store: &Store, name: u8) -> Option<JobRows> {
    store.get(&[name; 32], SHAPE)
}

#[test]
fn what_was_put_is_there_after_reopening() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    store.put([1; 32], &rows(100, 9));
    drop(store);
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    assert_eq!(get(&store, 1), Some(rows(100, 9)));
    assert_eq!(get(&store, 2), None);
    assert_eq!(store.warning(), None);
    // a job with other rows or ends does not take it
    assert_eq!(store.get(&[1; 32], Shape { rows: 9, ..SHAPE }), None);
}

#[test]
fn the_oldest_go_first_when_it_is_full() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 10_000).unwrap();
    for name in 0..20 {
        store.put([name; 32], &rows(2_000, name));
    }
    store.close();
    assert!(store.bytes() <= 10_000);
    let kept: Vec<u8> = (0..20)
        .filter(|&name| get(&store, name).is_some())
        .collect();
    assert_eq!(kept, [18, 19]);
}

#[test]
fn a_result_larger_than_the_store_is_not_kept() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 1_000).unwrap();
    store.put([1; 32], &rows(100, 1));
    store.put([2; 32], &rows(5_000, 2));
    store.close();
    assert_eq!(get(&store, 1), Some(rows(100, 1)));
    assert_eq!(get(&store, 2), None);
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
    assert!(warning.contains("put aside"), "{warning}");
    store.put([1; 32], &rows(10, 1));
    store.close();
    assert_eq!(get(&store, 1), Some(rows(10, 1)));
}

#[test]
fn a_broken_result_is_not_taken() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::open(folder.path(), 1 << 20).unwrap();
    store.put([1; 32], &rows(5_000, 249));
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
    store.put([1; 32], &rows(5_000, 249));
    store.close();
    assert_eq!(get(&store, 1), Some(rows(5_000, 249)));
}
