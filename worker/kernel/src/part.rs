//! A part of what is done one after the other: one of several jobs that together do the whole.

use std::ops::Range;

/// Part `number` of `of` parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    number: u32,
    of: u32,
}

impl Default for Part {
    /// The only one.
    fn default() -> Self {
        Self::new(0, 1)
    }
}

impl Part {
    /// 0 parts stand for 1. A part that there is not is the empty one.
    pub fn new(number: u32, of: u32) -> Self {
        let of = of.max(1);
        Self {
            number: number.min(of),
            of,
        }
    }

    /// Its number, from 0.
    pub fn number(self) -> u32 {
        self.number
    }

    /// How many parts there are.
    pub fn count(self) -> u32 {
        self.of
    }

    /// The items of this part: each of `len` items is in one part.
    pub fn of(self, len: usize) -> Range<usize> {
        let at = |k: u32| (len as u128 * u128::from(k.min(self.of)) / u128::from(self.of)) as usize;
        at(self.number)..at(self.number.saturating_add(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_hold_every_item_once_and_in_order() {
        for len in [0, 1, 2, 7, 100] {
            for of in [0, 1, 2, 3, 150] {
                let items: Vec<usize> = (0..of.max(1))
                    .flat_map(|k| Part::new(k, of).of(len))
                    .collect();
                assert_eq!(items, (0..len).collect::<Vec<_>>());
            }
        }
        assert!(Part::new(3, 3).of(9).is_empty());
        assert!(Part::new(u32::MAX, u32::MAX).of(9).is_empty());
    }
}
