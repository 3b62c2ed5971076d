//! Rows that are valid and wrong, made from those that a job has.

use nestrad_kernel::packed::{Packer, Pair, Shape, for_each_pair};
use nestrad_proto::v1::RowsHeader;

/// What becomes of the rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Lie {
    /// Everything is seen twice.
    Scaled,
    /// Rows stand in the place of others.
    Swapped,
    /// Every other thing that is seen is left out.
    Dropped,
    /// What rows see of each other, one of them sees in another row.
    Moved,
    /// One pair of all is another.
    OneOff,
    /// So many pairs, which take few bits each.
    Swollen(u32),
}

impl Lie {
    /// Those that are of about the size of the truth.
    pub(crate) const ALL: [Self; 5] = [
        Self::Scaled,
        Self::Swapped,
        Self::Dropped,
        Self::Moved,
        Self::OneOff,
    ];

    /// The packed rows with this lie, and the header that goes with them.
    /// Nothing where they cannot be read.
    pub(crate) fn told(
        self,
        header: &RowsHeader,
        packed: &[u8],
        shape: Shape,
    ) -> Option<(RowsHeader, Vec<u8>)> {
        let (mut mutual, mut single) = (Vec::new(), Vec::new());
        for_each_pair(packed, shape, |row, seen, both| {
            let list = if both { &mut mutual } else { &mut single };
            list.push((row, seen));
        })
        .ok()?;
        match self {
            Self::Scaled => {
                mutual.extend_from_within(..);
                single.extend_from_within(..);
            }
            Self::Swapped => swap(&mut single, shape),
            Self::Dropped => {
                drop_every_other(&mut mutual);
                drop_every_other(&mut single);
            }
            Self::Moved => {
                for (_, other) in &mut mutual {
                    *other = other.saturating_sub(1);
                }
            }
            Self::OneOff => {
                if let Some((_, end)) = single.iter_mut().max() {
                    *end = end.saturating_sub(1);
                }
            }
            Self::Swollen(pairs) => {
                (mutual, single) = (vec![(0, 0); pairs as usize], Vec::new());
            }
        }
        Some(pack(header, mutual, single, shape))
    }
}

/// The first row for the last, and so on.
fn swap(pairs: &mut [Pair], shape: Shape) {
    for (row, _) in pairs {
        *row = shape.rows - 1 - *row;
    }
}

fn drop_every_other(pairs: &mut Vec<Pair>) {
    let mut keeps = false;
    pairs.retain(|_| {
        keeps = !keeps;
        keeps
    });
}

fn pack(
    header: &RowsHeader,
    mut mutual: Vec<Pair>,
    mut single: Vec<Pair>,
    shape: Shape,
) -> (RowsHeader, Vec<u8>) {
    for list in [&mut mutual, &mut single] {
        list.sort_unstable_by_key(|&(row, seen)| (row, !seen));
    }
    let mut packer = Packer::new(shape.ends as usize);
    mutual
        .iter()
        .for_each(|&(row, other)| packer.mutual(row, other));
    single
        .iter()
        .for_each(|&(row, end)| packer.single(row, end));
    let entries = packer.entries();
    let packed = packer.finish();
    let header = RowsHeader {
        packed_bytes: packed.len() as u64,
        checksum: blake3::hash(&packed).as_bytes().to_vec(),
        entries,
        ..header.clone()
    };
    (header, packed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_lie_is_valid_and_differs() {
        let shape = Shape { rows: 6, ends: 9 };
        let mut packer = Packer::new(9);
        for (row, other) in [(1, 0), (3, 2), (3, 1), (5, 5)] {
            packer.mutual(row, other);
        }
        for (row, end) in [(0, 8), (2, 7), (2, 6), (4, 8)] {
            packer.single(row, end);
        }
        let entries = packer.entries();
        let packed = packer.finish();
        let header = RowsHeader {
            rows: 6,
            entries,
            ..RowsHeader::default()
        };
        for lie in Lie::ALL.into_iter().chain([Lie::Swollen(1000)]) {
            let (told, lies) = lie
                .told(&header, &packed, shape)
                .expect("rows that can be read");
            assert!(lies != packed, "{lie:?}");
            let checked = nestrad_kernel::packed::check(&lies, shape, told.entries);
            assert_eq!(checked, Ok(()), "{lie:?}");
        }
    }
}
