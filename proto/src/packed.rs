//! Packed rows: the form in which rows travel and are kept; see `RowsHeader` in `worker.proto`.
//!
//! A job of few lines gives most rows nothing, so empty rows cost nothing, and a row of one entry costs
//! a byte more than the entry.

use std::ops::Range;

use thiserror::Error;

use crate::v1;

/// Bytes that an entry takes where there are that many ends.
pub fn end_bytes(ends: usize) -> usize {
    let largest = ends.saturating_sub(1) as u64;
    (1..4).find(|&b| largest >> (8 * b) == 0).unwrap_or(4)
}

/// Most bytes that these rows can take: a limit before memory is taken.
pub fn most_bytes(rows: u64, entries: u64, end_bytes: usize) -> u64 {
    entries * end_bytes as u64 + 10 * rows.min(entries)
}

/// Packs rows; entries are below `1 << (8 * end_bytes)`.
pub fn pack(rows: &v1::Rows, end_bytes: usize) -> Vec<u8> {
    let mut packed = Vec::with_capacity(rows.ends.len() * (end_bytes + 1));
    let (mut empty, mut at) = (0, 0);
    for &length in &rows.lengths {
        if length == 0 {
            empty += 1;
            continue;
        }
        put_varint(&mut packed, 2 * empty + u64::from(length > 1));
        if length > 1 {
            put_varint(&mut packed, u64::from(length - 2));
        }
        for end in &rows.ends[at..at + length as usize] {
            packed.extend_from_slice(&end.to_le_bytes()[..end_bytes]);
        }
        at += length as usize;
        empty = 0;
    }
    packed
}

/// Why packed rows cannot be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum PackedFault {
    /// The bytes end within a row.
    #[error("packed rows end within a row")]
    CutOff,
    /// A number is longer than any that can be meant.
    #[error("packed rows hold a number out of range")]
    Number,
    /// The rows do not hold what was announced.
    #[error("packed rows hold {found} {what}, expected {expected}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many there are, at least.
        found: u64,
        /// How many there should be.
        expected: u64,
    },
    /// An entry stands for nothing that there is.
    #[error("packed rows see end {end}, there are {ends}")]
    End {
        /// The entry.
        end: u32,
        /// Number of ends.
        ends: u32,
    },
}

/// Calls `row` with the number of each row that has entries, and the bytes of these.
pub fn for_each_row<'a>(
    packed: &'a [u8],
    end_bytes: usize,
    mut row: impl FnMut(u64, &'a [u8]) -> Result<(), PackedFault>,
) -> Result<(), PackedFault> {
    let (mut at, mut number) = (0, 0u64);
    while at < packed.len() {
        let head = take_varint(packed, &mut at)?;
        let length = if head % 2 == 0 {
            1
        } else {
            take_varint(packed, &mut at)? + 2
        };
        number += head / 2;
        let bytes = length * end_bytes as u64;
        let left = (packed.len() - at) as u64;
        if bytes > left {
            return Err(PackedFault::CutOff);
        }
        row(number, &packed[at..at + bytes as usize])?;
        at += bytes as usize;
        number += 1;
    }
    Ok(())
}

/// The entries in the bytes of a row.
pub fn entries(bytes: &[u8], end_bytes: usize) -> impl Iterator<Item = u32> {
    bytes.chunks_exact(end_bytes).map(|b| {
        let mut end = [0; 4];
        end[..b.len()].copy_from_slice(b);
        u32::from_le_bytes(end)
    })
}

/// Checks that packed rows are what they should be: nothing in them is trusted.
pub fn check(packed: &[u8], rows: u64, expected: u64, ends: u32) -> Result<(), PackedFault> {
    let end_bytes = end_bytes(ends as usize);
    let mut found = 0;
    for_each_row(packed, end_bytes, |row, bytes| {
        if row >= rows {
            return Err(PackedFault::Count {
                what: "rows",
                found: row + 1,
                expected: rows,
            });
        }
        found += (bytes.len() / end_bytes) as u64;
        match entries(bytes, end_bytes).find(|&end| end >= ends) {
            Some(end) => Err(PackedFault::End { end, ends }),
            None => Ok(()),
        }
    })?;
    if found == expected {
        Ok(())
    } else {
        Err(PackedFault::Count {
            what: "entries",
            found,
            expected,
        })
    }
}

/// Joins the rows of several jobs, row by row, in the order of the jobs.
pub fn join(jobs: &[&[u8]], rows: usize, end_bytes: usize) -> Result<v1::Rows, PackedFault> {
    let mut lengths = vec![0u32; rows];
    let place = |number: u64| -> Result<usize, PackedFault> {
        let found = number + 1;
        if number < rows as u64 {
            return Ok(number as usize);
        }
        Err(PackedFault::Count {
            what: "rows",
            found,
            expected: rows as u64,
        })
    };
    for job in jobs {
        for_each_row(job, end_bytes, |row, bytes| {
            let length = &mut lengths[place(row)?];
            let more = (bytes.len() / end_bytes) as u32;
            *length = length.checked_add(more).ok_or(PackedFault::Number)?;
            Ok(())
        })?;
    }
    let mut next: Vec<usize> = Vec::with_capacity(rows);
    let mut total = 0;
    for &length in &lengths {
        next.push(total);
        total += length as usize;
    }
    let mut ends = vec![0u32; total];
    for job in jobs {
        for_each_row(job, end_bytes, |row, bytes| {
            let at = &mut next[place(row)?];
            let range: Range<usize> = *at..*at + bytes.len() / end_bytes;
            *at = range.end;
            for (to, end) in ends[range].iter_mut().zip(entries(bytes, end_bytes)) {
                *to = end;
            }
            Ok(())
        })?;
    }
    Ok(v1::Rows {
        lengths,
        ends,
        ..v1::Rows::default()
    })
}

fn put_varint(to: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        to.push(number as u8 | 0x80);
        number >>= 7;
    }
    to.push(number as u8);
}

/// A number below 2^35: no row is longer, and no more rows are empty.
fn take_varint(from: &[u8], at: &mut usize) -> Result<u64, PackedFault> {
    let mut number = 0;
    for shift in (0..35).step_by(7) {
        let byte = *from.get(*at).ok_or(PackedFault::CutOff)?;
        *at += 1;
        number |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Ok(number);
        }
    }
    Err(PackedFault::Number)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn rows(lists: &[Vec<u32>]) -> v1::Rows {
        v1::Rows {
            lengths: lists.iter().map(|l| l.len() as u32).collect(),
            ends: lists.concat(),
            ..v1::Rows::default()
        }
    }

    #[test]
    fn an_entry_takes_as_many_bytes_as_it_needs() {
        let needed: Vec<usize> = [1, 256, 257, 1 << 16, (1 << 16) + 1, 1 << 24, (1 << 24) + 1]
            .iter()
            .map(|&ends| end_bytes(ends))
            .collect();
        assert_eq!(needed, [1, 1, 2, 2, 3, 3, 4]);
    }

    #[test]
    fn empty_rows_cost_nothing() {
        let mut lists = vec![Vec::new(); 1000];
        lists[60] = vec![9];
        assert_eq!(pack(&rows(&lists), 3).len(), 4);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let lists = [vec![1], vec![], vec![2, 3, 4]];
        let packed = pack(&rows(&lists), 1);
        assert_eq!(check(&packed, 3, 4, 5), Ok(()));
        assert!(matches!(
            check(&packed, 2, 4, 5),
            Err(PackedFault::Count { what: "rows", .. })
        ));
        assert!(matches!(
            check(&packed, 3, 5, 5),
            Err(PackedFault::Count {
                what: "entries",
                ..
            })
        ));
        assert_eq!(
            check(&packed, 3, 4, 4),
            Err(PackedFault::End { end: 4, ends: 4 })
        );
        assert_eq!(
            check(&packed[..packed.len() - 1], 3, 4, 5),
            Err(PackedFault::CutOff)
        );
        assert_eq!(check(&[0x80; 9], 3, 4, 5), Err(PackedFault::Number));
    }

    proptest! {
        #[test]
        fn rows_of_jobs_are_joined_in_order(
            jobs in prop::collection::vec(
                prop::collection::vec(prop::collection::vec(0u32..70_000, 0..4), 12), 0..5),
        ) {
            let ends = 70_000;
            let bytes = end_bytes(ends);
            let packed: Vec<Vec<u8>> = jobs.iter().map(|j| pack(&rows(j), bytes)).collect();
            for (packed, job) in packed.iter().zip(&jobs) {
                let entries = job.iter().map(Vec::len).sum::<usize>() as u64;
                prop_assert_eq!(check(packed, 12, entries, ends as u32), Ok(()));
                prop_assert!(packed.len() as u64 <= most_bytes(12, entries, bytes));
            }
            let parts: Vec<&[u8]> = packed.iter().map(Vec::as_slice).collect();
            let expected: Vec<Vec<u32>> =
                (0..12).map(|r| jobs.iter().flat_map(|j| j[r].clone()).collect()).collect();
            prop_assert_eq!(join(&parts, 12, bytes), Ok(rows(&expected)));
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            for width in 1..=4 {
                let _ = for_each_row(&bytes, width, |_, _| Ok(()));
            }
            let _ = check(&bytes, 10, 10, 1000);
            let _ = join(&[&bytes], 10, 2);
        }
    }
}
