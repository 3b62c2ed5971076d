//! The options that say what is kept from solve to solve.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use nestrad_cluster::store::{Store, StoreError};
use nestrad_engine::causes::causes;

use super::numbers::positive;

#[derive(Debug, Args)]
#[command(next_help_heading = "Kept results")]
pub(crate) struct StateFlags {
    /// Folder in which finished near-field jobs are kept: an interrupted solve continues, and a geometry with
    /// other light or other optics is not traced again
    #[arg(long, value_name = "DIR")]
    state: Option<PathBuf>,

    /// Disk space for --state, GiB; where it is full, the oldest jobs are deleted
    #[arg(long, value_name = "GIB", default_value_t = 16.0, value_parser = positive)]
    state_size: f64,
}

impl StateFlags {
    /// Opens the store, if one is asked for. A disk that cannot be written to is told, and nothing is kept; what
    /// cannot be meant, such as the folder of another master, is an error.
    pub(crate) fn open(&self, tell: impl FnOnce(&str)) -> Result<Option<Store>> {
        let Some(dir) = &self.state else {
            return Ok(None);
        };
        let most_bytes = (self.state_size * (1u64 << 30) as f64) as u64;
        match Store::open(dir, most_bytes) {
            Ok(store) => {
                if let Some(warning) = store.warning() {
                    tell(&warning);
                }
                Ok(Some(store))
            }
            Err(error @ (StoreError::InUse { .. } | StoreError::NoFolder { .. })) => {
                Err(error.into())
            }
            Err(error) => {
                tell(&format!("no results are kept: {}", causes(&error)));
                Ok(None)
            }
        }
    }
}
