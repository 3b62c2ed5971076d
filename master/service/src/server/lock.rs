//! Locks on what is whole at any time.

use std::sync::{Mutex, MutexGuard, PoisonError};

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // what is behind these locks is whole at any time, even if a thread died with one
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
