//! The options that say what is kept from solve to solve.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use nestrad_cluster::store::Store;

use super::numbers::positive;

#[derive(Debug, Args)]
#[command(next_help_heading = "What is kept")]
pub(crate) struct StateFlags {
    /// Folder in which finished near-field jobs are kept: a solve that was cut short goes on, and the same
    /// geometry under other lights or with other optics traces nothing
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,

    /// Disk space for --state, GiB; the oldest goes first
    #[arg(long, value_name = "GIB", default_value_t = 16.0, value_parser = positive)]
    state_size: f64,
}

impl StateFlags {
    /// Opens the store, if one is asked for.
    pub(crate) fn open(&self) -> Result<Option<Store>> {
        let most_bytes = (self.state_size * (1u64 << 30) as f64) as u64;
        let store = self
            .state
            .as_deref()
            .map(|dir| Store::open(dir, most_bytes));
        Ok(store.transpose()?)
    }
}
