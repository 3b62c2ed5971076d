//! The source of rows that a process has: itself or its workers, and before them what is kept.

use nestrad_engine::exchange::{RowSource, ThisProcess};

use crate::cluster::Cluster;
use crate::kept::Kept;
use crate::solving::Workers;
use crate::store::Store;

/// Lends a source of rows: workers where there are any, else this process; before it what a store has.
pub fn with_rows<T>(
    workers: Option<&Cluster>,
    kept: Option<&Store>,
    use_rows: impl FnOnce(&dyn RowSource) -> T,
) -> T {
    let here = ThisProcess::default();
    let workers = workers.map(Workers::of);
    let traced: &dyn RowSource = match &workers {
        Some(workers) => workers,
        None => &here,
    };
    match kept {
        Some(store) => use_rows(&Kept::before(traced, store)),
        None => use_rows(traced),
    }
}
