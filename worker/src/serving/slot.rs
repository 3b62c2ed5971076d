//! One job after the other, on one thread.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

use bytes::Bytes;
use nestrad_kernel::job::Batch;
use nestrad_kernel::trace;
use nestrad_proto::v1::RowsHeader;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use tokio::sync::oneshot;

use super::blocks::Ready;

/// A pool of one thread for each job at a time: jobs then neither wait for one another, nor take turns on
/// one thread.
pub(super) fn pools(threads: u32) -> Result<Vec<Arc<ThreadPool>>, ThreadPoolBuildError> {
    let pool = |k: u32| {
        let named = move |_| format!("job {k}");
        let builder = ThreadPoolBuilder::new().num_threads(1).thread_name(named);
        builder.build().map(Arc::new)
    };
    (0..threads).map(pool).collect()
}

/// Rows, ready to travel; the header lacks worker and lease.
pub(super) struct Computed {
    pub(super) header: RowsHeader,
    pub(super) packed: Bytes,
}

/// Computes a job on a thread of its own; the error says why it failed.
pub(super) async fn compute(
    pool: &ThreadPool,
    ready: Arc<Ready>,
    batch: Batch,
) -> Result<Computed, String> {
    let (sender, computed) = oneshot::channel();
    pool.spawn(move || {
        let result = catch_unwind(AssertUnwindSafe(|| rows(&ready, &batch)));
        // a panic is a fault of the kernel with this job; the worker lives on
        let result = result.map_err(|_| "the kernel panicked".to_owned());
        drop(ready);
        // nobody listens where the job is not wanted any more
        let _ = sender.send(result);
    });
    computed.await.map_err(|_| "its thread died".to_owned())?
}

fn rows(ready: &Ready, batch: &Batch) -> Computed {
    let begun = Instant::now();
    let seen = trace(&ready.block, || ready.tracer(), batch);
    let rows = seen.packed(&ready.block);
    let counts = rows.counts;
    Computed {
        header: RowsHeader {
            packed_bytes: rows.packed.len() as u64,
            checksum: blake3::hash(&rows.packed).as_bytes().to_vec(),
            rows: ready.block.rows() as u32,
            entries: counts.row_entries,
            lines: counts.lines,
            segments: counts.segments,
            rays: counts.rays,
            compute_s: begun.elapsed().as_secs_f64(),
            ..RowsHeader::default()
        },
        packed: rows.packed.into(),
    }
}
