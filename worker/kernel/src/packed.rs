//! Packed rows: the form in which rows travel and are kept; see `RowsHeader` in the protocol.
//!
//! What two rows see of each other along a line is one pair, which is packed once. Pairs stand by row, and
//! faces that see each other have numbers close together as a rule: so both are packed as differences.

use thiserror::Error;

use crate::bits::{Reader, Writer};

/// A row, and what it sees: of a mutual pair a row that is not behind it, of a single one an end.
pub type Pair = (u32, u32);

/// Fewest bits of a pair, and most.
const LEAST_BITS: u64 = 6;
const MOST_BITS: u64 = 2 * 31 + 1 + 5 + 31;

/// Two counts of at most 10 bytes, and what is left empty in two last bytes.
const MOST_HEAD: u64 = 22;

/// Most bytes that so many entries can take: a limit before memory is taken.
pub fn most_bytes(entries: u64) -> u64 {
    MOST_HEAD + entries.saturating_mul(MOST_BITS).div_ceil(8)
}

/// Most entries that so many bytes can hold.
pub fn most_entries(bytes: u64) -> u64 {
    bytes.saturating_mul(8) / LEAST_BITS * 2
}

/// Packs pairs as they come: those of each kind by rising row, and within a row by falling number of what
/// is seen.
#[derive(Debug)]
pub struct Packer {
    mutual: List,
    single: List,
    /// The largest end.
    top: u32,
}

#[derive(Debug, Default)]
struct List {
    bits: Writer,
    pairs: u64,
    /// The pair before.
    last: Option<Pair>,
}

impl List {
    fn push(&mut self, (row, seen): Pair, top: u32) {
        let (rows, from) = match self.last {
            Some((last, before)) if last == row => (0, before),
            Some((last, _)) => (row - last, top),
            None => (row, top),
        };
        self.bits.put_gamma(rows);
        self.bits.put_classed(from - seen);
        self.last = Some((row, seen));
        self.pairs += 1;
    }
}

impl Packer {
    /// For a world of so many ends, at least 1.
    pub fn new(ends: usize) -> Self {
        Self {
            mutual: List::default(),
            single: List::default(),
            top: ends.saturating_sub(1) as u32,
        }
    }

    /// Two rows that see each other's ends; the second is not larger than the first.
    pub fn mutual(&mut self, row: u32, other: u32) {
        self.mutual.push((row, other), row);
    }

    /// A row that sees an end.
    pub fn single(&mut self, row: u32, end: u32) {
        self.single.push((row, end), self.top);
    }

    /// Entries of all rows so far.
    pub fn entries(&self) -> u64 {
        2 * self.mutual.pairs + self.single.pairs
    }

    /// The packed rows.
    pub fn finish(self) -> Vec<u8> {
        let mut packed = Vec::new();
        for list in [&self.mutual, &self.single] {
            put_varint(&mut packed, list.pairs);
        }
        packed.extend(self.mutual.bits.finish());
        packed.extend(self.single.bits.finish());
        packed
    }
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
}

/// How many rows a block has, and how many ends its world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Rows of the block, empty ones included.
    pub rows: u32,
    /// Ends of the world.
    pub ends: u32,
}

/// Calls `pair` with every pair, and whether it is mutual. Nothing that is read is trusted: rows and ends are
/// within the shape.
pub fn for_each_pair(
    packed: &[u8],
    shape: Shape,
    mut pair: impl FnMut(u32, u32, bool),
) -> Result<(), PackedFault> {
    let mut at = 0;
    let mutual = take_varint(packed, &mut at)?;
    let single = take_varint(packed, &mut at)?;
    let mut bits = Reader::new(&packed[at..]);
    read(&mut bits, mutual, shape, |row| row, |a, b| pair(a, b, true))?;
    bits.align();
    let top = shape.ends.checked_sub(1).ok_or(PackedFault::Number)?;
    read(&mut bits, single, shape, |_| top, |a, b| pair(a, b, false))?;
    bits.align();
    if bits.is_at_end() {
        return Ok(());
    }
    Err(PackedFault::Count {
        what: "bytes",
        found: packed.len() as u64,
        expected: (at + bits.taken_bytes()) as u64,
    })
}

/// Reads so many pairs; `top` gives the largest number that can be seen by a row.
#[inline]
fn read(
    bits: &mut Reader,
    pairs: u64,
    shape: Shape,
    top: impl Fn(u32) -> u32,
    mut pair: impl FnMut(u32, u32),
) -> Result<(), PackedFault> {
    let (mut row, mut seen, mut first) = (0u32, 0u32, true);
    for _ in 0..pairs {
        let Some(rows) = bits.take_gamma() else {
            let cut_off = bits.nears_end();
            return Err(if cut_off {
                PackedFault::CutOff
            } else {
                PackedFault::Number
            });
        };
        if first || rows > 0 {
            row = row.checked_add(rows).ok_or(PackedFault::Number)?;
            if row >= shape.rows {
                return Err(PackedFault::Count {
                    what: "rows",
                    found: u64::from(row) + 1,
                    expected: u64::from(shape.rows),
                });
            }
            seen = top(row);
            first = false;
        }
        let less = bits.take_classed();
        if bits.is_beyond_end() {
            return Err(PackedFault::CutOff);
        }
        seen = seen.checked_sub(less).ok_or(PackedFault::Number)?;
        pair(row, seen);
    }
    Ok(())
}

/// Checks that packed rows are what they should be.
pub fn check(packed: &[u8], shape: Shape, expected: u64) -> Result<(), PackedFault> {
    let mut found = 0;
    for_each_pair(packed, shape, |_, _, mutual| found += 1 + u64::from(mutual))?;
    if found == expected {
        return Ok(());
    }
    Err(PackedFault::Count {
        what: "entries",
        found,
        expected,
    })
}

fn put_varint(to: &mut Vec<u8>, mut number: u64) {
    while number >= 0x80 {
        to.push(number as u8 | 0x80);
        number >>= 7;
    }
    to.push(number as u8);
}

/// A number below 2^42: no job has more pairs.
fn take_varint(from: &[u8], at: &mut usize) -> Result<u64, PackedFault> {
    let mut number = 0;
    for shift in (0..42).step_by(7) {
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

    const SHAPE: Shape = Shape {
        rows: 50_000,
        ends: 70_000,
    };

    fn pack(mutual: &[Pair], single: &[Pair], ends: u32) -> Vec<u8> {
        let mut packer = Packer::new(ends as usize);
        mutual.iter().for_each(|&(a, b)| packer.mutual(a, b));
        single.iter().for_each(|&(a, b)| packer.single(a, b));
        packer.finish()
    }

    fn unpack(packed: &[u8], shape: Shape) -> Result<[Vec<Pair>; 2], PackedFault> {
        let (mut mutual, mut single) = (Vec::new(), Vec::new());
        for_each_pair(packed, shape, |a, b, both| {
            let list = if both { &mut mutual } else { &mut single };
            list.push((a, b));
        })?;
        Ok([mutual, single])
    }

    #[test]
    fn neighbours_take_little_room() {
        let neighbours: Vec<Pair> = (1..=1000).map(|row| (row, row - 1)).collect();
        let sky: Vec<Pair> = (0..1000).map(|row| (row, 1002)).collect();
        // a row further on 3 bits, a number 5 and as many as it needs
        let bytes = pack(&neighbours, &sky, 1003).len();
        assert_eq!(bytes, 4 + (8 * 1000 + 1000) / 8 + (8 * 1000 - 2) / 8 + 1);
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        let packed = pack(&[(0, 0), (2, 1)], &[(2, 4)], 5);
        let shape = Shape { rows: 3, ends: 5 };
        assert_eq!(check(&packed, shape, 5), Ok(()));
        let few = Shape { rows: 2, ends: 5 };
        let fault = |what| move |f: &PackedFault| matches!(f, PackedFault::Count { what: w, .. } if *w == what);
        assert!(check(&packed, few, 5).is_err_and(|f| fault("rows")(&f)));
        assert!(check(&packed, shape, 4).is_err_and(|f| fault("entries")(&f)));
        let mut long = packed.clone();
        long.push(0);
        assert!(check(&long, shape, 5).is_err_and(|f| fault("bytes")(&f)));
        let cut = check(&packed[..packed.len() - 1], shape, 5);
        assert_eq!(cut, Err(PackedFault::CutOff));
        // row 2 sees an end below the first
        let below = pack(&[], &[(2, 0)], 6);
        assert_eq!(check(&below, shape, 1), Err(PackedFault::Number));
        assert_eq!(check(&[0x80; 9], shape, 1), Err(PackedFault::Number));
        assert_eq!(check(&[], shape, 0), Err(PackedFault::CutOff));
        assert_eq!(check(&[0, 0], shape, 0), Ok(()));
    }

    proptest! {
        #[test]
        fn pairs_come_back(
            mut mutual in prop::collection::vec((0..SHAPE.rows, 0..SHAPE.rows), 0..50),
            mut single in prop::collection::vec((0..SHAPE.rows, 0..SHAPE.ends), 0..50),
        ) {
            for pair in &mut mutual {
                *pair = (pair.0.max(pair.1), pair.0.min(pair.1));
            }
            for list in [&mut mutual, &mut single] {
                list.sort_by_key(|&(row, seen)| (row, !seen));
            }
            let packed = pack(&mutual, &single, SHAPE.ends);
            let entries = (2 * mutual.len() + single.len()) as u64;
            prop_assert_eq!(check(&packed, SHAPE, entries), Ok(()));
            prop_assert!(packed.len() as u64 <= most_bytes(entries));
            prop_assert!(entries <= most_entries(packed.len() as u64));
            prop_assert_eq!(unpack(&packed, SHAPE), Ok([mutual, single]));
        }

        #[test]
        fn any_bytes_are_read_or_refused(
            mut bytes in prop::collection::vec(any::<u8>(), 0..200),
            counts in (0u8..100, 0u8..100),
        ) {
            let _ = check(&bytes, SHAPE, 10);
            if let [mutual, single, ..] = &mut bytes[..] {
                (*mutual, *single) = counts;
            }
            if let Ok([mutual, single]) = unpack(&bytes, SHAPE) {
                prop_assert!(mutual.iter().all(|&(a, b)| b <= a && a < SHAPE.rows));
                prop_assert!(single.iter().all(|&(a, b)| a < SHAPE.rows && b < SHAPE.ends));
            }
        }
    }
}
