//! Rows on their way in: nothing in them is trusted.

use std::time::Duration;

use nestrad_engine::exchange::JobRows;
use nestrad_kernel::PackedRows;
use nestrad_kernel::packed::{self, Shape};
use nestrad_kernel::rows::Counts;
use nestrad_proto::v1::{ReturnRowsRequest, RowsHeader, return_rows_request};
use tonic::{Code, Status, Streaming};

use crate::room::Coming;

/// What a result has to fit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expected {
    pub(crate) shape: Shape,
    pub(crate) most_bytes: u64,
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
pub(crate) fn check_header(header: &RowsHeader, expected: &Expected) -> Result<(), Status> {
    let fault = |what: &str, found: u64, limit: u64| {
        Err(Status::invalid_argument(format!(
            "result with {found} {what}, expected {limit}"
        )))
    };
    if header.rows != expected.shape.rows {
        let rows = u64::from(expected.shape.rows);
        return fault("rows", u64::from(header.rows), rows);
    }
    let (entries, bytes) = (header.entries, header.packed_bytes);
    if bytes > expected.most_bytes {
        return fault("bytes", bytes, expected.most_bytes);
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
    packed::check(&body, expected.shape, header.entries)
        .map_err(|fault| Status::invalid_argument(fault.to_string()))?;
    let counts = Counts {
        lines: header.lines,
        segments: header.segments,
        rays: header.rays,
        row_entries: header.entries,
    };
    let rows = PackedRows {
        packed: body,
        counts,
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
