//! Memory that solves have let go of.
//!
//! glibc keeps what is freed for what may come, in an arena for each thread, and once large blocks have been
//! freed it no longer takes new ones from the system. A master that solves for days would keep ever more of
//! it: 62 MB after 700 solves of a small scene, 239 MB after 4,300, where 20 are in use.

#![allow(
    unsafe_code,
    reason = "the allocator is asked to give memory back, for which there is only a C function"
)]

use std::time::{Duration, Instant};

/// Has every large block taken from the system and given back to it alone, whatever was freed before. To be called
/// once, before there are threads: without it a solve takes a tenth more than it uses at its peak.
pub fn settle() {
    #[cfg(target_env = "gnu")]
    // SAFETY: sets two numbers of the allocator.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE_BYTES);
        libc::mallopt(libc::M_TRIM_THRESHOLD, 8 * LARGE_BYTES);
    }
}

/// Blocks from this size on are large.
#[cfg(target_env = "gnu")]
const LARGE_BYTES: libc::c_int = 1 << 20;

/// Takes what the numbers of a slice stand in back from them, page by page, long before the slice goes: they are
/// lost.
pub(crate) fn forget(numbers: &mut [u32]) {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: reads a number.
        let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) };
        let Some(page) = usize::try_from(page).ok().filter(|p| p.is_power_of_two()) else {
            return;
        };
        let (first, bytes) = (numbers.as_mut_ptr().cast::<u8>(), size_of_val(numbers));
        // whole pages alone: others have the rest
        let skipped = first.align_offset(page);
        let Some(whole) = bytes.checked_sub(skipped).map(|bytes| bytes / page * page) else {
            return;
        };
        if whole > 0 {
            // SAFETY: the pages lie within the slice, which nobody else can read meanwhile; they read as zeros
            // afterwards, which are numbers.
            unsafe {
                libc::madvise(first.add(skipped).cast(), whole, libc::MADV_DONTNEED);
            }
        }
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    let _ = numbers;
}

/// Between two times that memory is given back: it takes milliseconds, and what is taken again as much.
const PAUSE: Duration = Duration::from_secs(1);

/// When free memory was last given back.
#[derive(Default)]
pub struct Freed {
    last: Option<Instant>,
}

impl Freed {
    /// Gives free memory back to the system, unless that was done just now.
    pub fn give_back(&mut self) {
        if self.last.is_some_and(|last| last.elapsed() < PAUSE) {
            return;
        }
        #[cfg(target_env = "gnu")]
        // SAFETY: may be called at any time, from any thread, and touches nothing that is in use.
        unsafe {
            libc::malloc_trim(0);
        }
        self.last = Some(Instant::now());
    }
}
