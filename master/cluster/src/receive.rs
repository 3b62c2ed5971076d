//! Rows on their way in: nothing in them is trusted.

use std::sync::Arc;
use std::time::Duration;

use nestrad_engine::exchange::{BlockOf, JobRows};
use nestrad_kernel::cost::LOOKED_NS;
use nestrad_kernel::expected::{Expected, OfBlock};
use nestrad_kernel::packed;
use nestrad_kernel::rows::Counts;
use nestrad_kernel::{Block, PackedRows};
use nestrad_proto::near_field;
use nestrad_proto::v1::{self, ReturnRowsRequest, RowsHeader, return_rows_request};
use tonic::{Code, Status, Streaming};

use crate::room::Coming;

/// What a result has to fit.
#[derive(Clone)]
pub(crate) struct Wanted {
    pub(crate) scene: Block,
    pub(crate) parts: Arc<[BlockOf]>,
    /// The block of the job, and what is known of it.
    pub(crate) block: usize,
    pub(crate) known: Arc<OfBlock>,
    pub(crate) batch: v1::Batch,
    pub(crate) cost_s: f64,
    pub(crate) most_bytes: u64,
}

/// Rows of lines of a result that are traced again, at most.
const MOST_LOOKS: u32 = 4;

impl Wanted {
    /// What holds of the rows, if they can be what their header says.
    pub(crate) fn job(&self, header: &RowsHeader) -> Result<Expected, Status> {
        let owned = self.parts[self.block].owned();
        let batch = near_field::batch(&self.batch);
        let job = self.known.job(&self.scene, &owned, &batch, &counts(header));
        job.map_err(|fault| Status::invalid_argument(fault.to_string()))
    }

    /// Whether what a few of its lines see is in the packed rows of a job. As many as take a share of its time are looked
    /// at, on average; `number` chooses which.
    pub(crate) fn is_seen_again(
        &self,
        packed: &[u8],
        share: f64,
        number: impl Fn(u32) -> u64,
    ) -> bool {
        let look_s = 1e-9 * LOOKED_NS * self.scene.soup().len().max(1) as f64;
        let looks = (share * self.cost_s / look_s).min(f64::from(MOST_LOOKS));
        let chance = (number(MOST_LOOKS) >> 11) as f64 / (1u64 << 53) as f64;
        let looks = (looks + chance) as u32;
        let batch = near_field::batch(&self.batch);
        (0..looks).all(|k| {
            let look = self.known.look(&self.scene, &batch, number(k));
            look.is_in(packed, self.known.shape())
        })
    }
}

fn counts(header: &RowsHeader) -> Counts {
    Counts {
        lines: header.lines,
        segments: header.segments,
        rays: header.rays,
        row_entries: header.entries,
    }
}

/// No count of lines, segments or rays is larger.
const MOST_COUNTED: u64 = 1 << 48;

/// The next message of a stream; an error where none comes in time.
pub(crate) async fn next(
    stream: &mut Streaming<ReturnRowsRequest>,
    patience: Duration,
) -> Result<Option<return_rows_request::Part>, Status> {
    let message = tokio::time::timeout(patience, stream.message())
        .await
        .map_err(|_| Status::deadline_exceeded("rows stopped coming"))??;
    match message {
        None => Ok(None),
        Some(ReturnRowsRequest { part: Some(part) }) => Ok(Some(part)),
        Some(ReturnRowsRequest { part: None }) => {
            Err(Status::invalid_argument("expected a header or a chunk"))
        }
    }
}

/// Refuses what a header promises to be too large or not to fit, before any memory is taken.
pub(crate) fn check_header(header: &RowsHeader, wanted: &Wanted) -> Result<(), Status> {
    let expected = wanted.known.shape();
    let fault = |what: &str, found: u64, limit: u64| {
        Err(Status::invalid_argument(format!(
            "result with {found} {what}, expected {limit}"
        )))
    };
    if header.rows != expected.rows {
        let rows = u64::from(expected.rows);
        return fault("rows", u64::from(header.rows), rows);
    }
    let (entries, bytes) = (header.entries, header.packed_bytes);
    if bytes > wanted.most_bytes {
        return fault("bytes", bytes, wanted.most_bytes);
    }
    if entries > packed::most_entries(bytes) || bytes > packed::most_bytes(entries) {
        return fault(
            "entries for its bytes",
            entries,
            packed::most_entries(bytes),
        );
    }
    if header.checksum.len() != 32 {
        return fault("bytes of checksum", header.checksum.len() as u64, 32);
    }
    let counted = header.lines.max(header.segments).max(header.rays);
    if counted > MOST_COUNTED {
        return fault("lines, segments or rays", counted, MOST_COUNTED);
    }
    Ok(())
}

/// All chunks of a result: as many bytes as its header says.
pub(crate) async fn body(
    stream: &mut Streaming<ReturnRowsRequest>,
    header: &RowsHeader,
    coming: &mut Coming<'_>,
    patience: Duration,
) -> Result<Vec<u8>, Status> {
    let size = header.packed_bytes as usize;
    let mut body = Vec::with_capacity(size);
    while let Some(part) = coming.wait(next(stream, patience), patience).await?? {
        let return_rows_request::Part::Chunk(chunk) = part else {
            return Err(Status::invalid_argument("expected a chunk, found a header"));
        };
        if chunk.len() > size - body.len() {
            let found = body.len() + chunk.len();
            let text = format!("result of {found} bytes or more, expected {size}");
            return Err(Status::invalid_argument(text));
        }
        coming.came(chunk.len());
        body.extend_from_slice(&chunk);
    }
    if body.len() < size {
        let text = format!("result of {} bytes, expected {size}", body.len());
        return Err(Status::invalid_argument(text));
    }
    Ok(body)
}

/// Checks every number of a result.
pub(crate) fn check_body(
    header: &RowsHeader,
    body: Vec<u8>,
    expected: &Expected,
) -> Result<JobRows, Status> {
    if blake3::hash(&body).as_bytes()[..] != header.checksum[..] {
        return Err(Status::data_loss("result does not match its checksum"));
    }
    expected
        .check(&body)
        .map_err(|fault| Status::invalid_argument(fault.to_string()))?;
    let rows = PackedRows {
        packed: body,
        counts: counts(header),
    };
    Ok(JobRows::Packed(rows.into()))
}

/// Whether an error says that the result is bad or comes too slowly, rather than that the connection is gone.
pub(crate) fn is_fault(status: &Status) -> bool {
    matches!(
        status.code(),
        Code::InvalidArgument | Code::DataLoss | Code::DeadlineExceeded
    )
}
