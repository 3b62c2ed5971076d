//! The threads that a command computes with.

use anyhow::{Context, Result};
use nestrad_common::threads::Threads;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::console::Notes;

/// So many threads as were asked for; what does not fit this machine is said.
pub(super) fn pool(asked: Option<usize>, notes: Notes) -> Result<ThreadPool> {
    let threads = Threads::asked(asked.unwrap_or(0));
    if let Some(warning) = &threads.warning {
        notes.say("warning", warning);
    }
    let pool = ThreadPoolBuilder::new().num_threads(threads.count).build();
    pool.context("cannot start threads")
}
