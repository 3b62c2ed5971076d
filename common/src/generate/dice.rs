//! The chance that makes one plant differ from the next.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Random numbers of one plant (or one canopy): they depend on the seed and on its number, not on
/// what else is generated.
pub(super) struct Dice(Pcg64);

impl Dice {
    pub(super) fn new(seed: u64, number: u32) -> Self {
        // the odd factor keeps what follows one seed apart from what follows its neighbours
        let mixed = seed
            .wrapping_mul(0x9e37_79b9_7f4a_7c15)
            .wrapping_add(u64::from(number));
        Self(Pcg64::seed_from_u64(mixed))
    }

    /// Uniform in `[0, 1)`.
    pub(super) fn unit(&mut self) -> f64 {
        self.0.random()
    }

    /// Uniform within `spread` of `mean`: bounded, so that no draw makes a freak.
    pub(super) fn around(&mut self, mean: f64, spread: f64) -> f64 {
        mean + spread * (2.0 * self.unit() - 1.0)
    }

    /// An angle in radians, any as likely as any other.
    pub(super) fn azimuth(&mut self) -> f64 {
        TAU * self.unit()
    }

    /// A whole number from `low` to `high`, both included.
    pub(super) fn whole(&mut self, low: u32, high: u32) -> u32 {
        self.0.random_range(low..=high)
    }

    /// A random order of the numbers below `count`.
    pub(super) fn order(&mut self, count: u32) -> Vec<u32> {
        let mut order: Vec<u32> = (0..count).collect();
        for i in (1..count).rev() {
            order.swap(i as usize, self.whole(0, i) as usize);
        }
        order
    }
}
