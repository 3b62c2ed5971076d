//! What is kept of each row: a number for every band of a group.

use crate::exchange::HALF_BATCHES;

/// Numbers that are kept side by side, so that one reading of a row serves them all. Computed with as f64,
/// whatever they are kept as.
pub(super) trait Lane<const N: usize>: Copy + Send + Sync {
    /// The numbers.
    fn get(&self) -> [f64; N];
    /// As they are kept.
    fn of(numbers: [f64; N]) -> Self;
}

impl<const N: usize> Lane<N> for [f64; N] {
    #[inline(always)]
    fn get(&self) -> [f64; N] {
        *self
    }

    #[inline(always)]
    fn of(numbers: [f64; N]) -> Self {
        numbers
    }
}

/// Bands whose standard errors are worked out together.
pub(super) const PULLED_TOGETHER: usize = 2;

/// Numbers in a [`Pull`].
pub(super) const PULLS: usize = PULLED_TOGETHER * HALF_BATCHES;

/// What each batch of a half does to a row, in two bands: batch `g` of band `k` is number
/// `k * HALF_BATCHES + g`.
///
/// A standard error is known to some 20 %, so f32 is enough to keep its parts in (6e-8 of each, and sums
/// are f64); and so a row is exactly one line of the cache, which is what following pulls spends its time
/// on.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Pull([f32; PULLS]);

impl Pull {
    pub(super) const NONE: Self = Self([0.0; PULLS]);

    /// Of the batches, in band `k` of the group.
    pub(super) fn of_band(&self, k: usize) -> [f64; HALF_BATCHES] {
        std::array::from_fn(|g| f64::from(self.0[k * HALF_BATCHES + g]))
    }
}

impl Lane<PULLS> for Pull {
    #[inline(always)]
    fn get(&self) -> [f64; PULLS] {
        self.0.map(f64::from)
    }

    #[inline(always)]
    fn of(numbers: [f64; PULLS]) -> Self {
        Self(numbers.map(|x| x as f32))
    }
}
