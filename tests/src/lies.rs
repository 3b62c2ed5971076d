//! Rows as pairs, to be made wrong and packed again.

use nestrad_kernel::packed::{Packer, Pair, Shape, for_each_pair};

/// Packed rows, unpacked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Pairs {
    /// Two rows that see each other.
    pub mutual: Vec<Pair>,
    /// A row, and the end that it sees.
    pub single: Vec<Pair>,
}

impl Pairs {
    /// Of a job of that shape.
    pub fn of(packed: &[u8], shape: Shape) -> Self {
        let mut pairs = Self::default();
        let put = |row, end, is_mutual| {
            let list = if is_mutual {
                &mut pairs.mutual
            } else {
                &mut pairs.single
            };
            list.push((row, end));
        };
        for_each_pair(packed, shape, put).unwrap();
        pairs
    }

    /// Packed again, and how many entries that are.
    pub fn packed(mut self, shape: Shape) -> (Vec<u8>, u64) {
        for pair in &mut self.mutual {
            *pair = (pair.0.max(pair.1), pair.0.min(pair.1));
        }
        let mut packer = Packer::new(shape.ends as usize);
        let by_row = |&(row, seen): &Pair| (row, !seen);
        self.mutual.sort_unstable_by_key(by_row);
        self.single.sort_unstable_by_key(by_row);
        self.mutual.iter().for_each(|&(a, b)| packer.mutual(a, b));
        self.single.iter().for_each(|&(a, b)| packer.single(a, b));
        let entries = packer.entries();
        (packer.finish(), entries)
    }

    /// Says everything twice.
    pub fn scale(&mut self) {
        self.mutual.extend(self.mutual.clone());
        self.single.extend(self.single.clone());
    }

    /// Gives every row what another one sees: all rows are as long as they were.
    pub fn swap(&mut self) {
        for list in [&mut self.mutual, &mut self.single] {
            let mut seen: Vec<u32> = list.iter().map(|pair| pair.1).collect();
            let far = seen.len() / 2;
            seen.rotate_left(far);
            for (pair, seen) in list.iter_mut().zip(seen) {
                pair.1 = seen;
            }
        }
    }

    /// The same with two pairs alone.
    pub fn swap_two(&mut self) {
        let list = &mut self.mutual;
        let first = list[0].1;
        if let Some(k) = list.iter().rposition(|pair| pair.1 != first) {
            list[0].1 = list[k].1;
            list[k].1 = first;
        }
    }

    /// Says nothing of half of the pairs.
    pub fn drop_half(&mut self) {
        for list in [&mut self.mutual, &mut self.single] {
            let mut k = 0;
            list.retain(|_| {
                k += 1;
                k % 2 == 0
            });
        }
    }
}
