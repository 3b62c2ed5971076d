//! Calls to the master. Each has a time-out; what fails for a while is tried again.

use std::time::Duration;

use bytes::Bytes;
use nestrad_kernel::kernel;
use nestrad_proto::channel::Authorized;
use nestrad_proto::v1::worker_service_client::WorkerServiceClient;
use nestrad_proto::v1::{
    FetchBlockRequest, GiveBackRequest, JoinRequest, JoinResponse, LeaseRequest, LeaveRequest,
    RenewRequest, ReturnRowsRequest, RowsHeader, fetch_block_response, lease_response,
    return_rows_request,
};
use nestrad_proto::{MAX_MESSAGE_BYTES, SLICE_BYTES, reason};
use tonic::{Code, Request, Status};

use super::{FIRST_PAUSE, LAST_PAUSE, Offer};

/// An answer to a small request, and the next chunk of a large one, come within this time.
const PATIENCE: Duration = Duration::from_secs(10);

/// How long a master is asked to wait for a job.
const WAIT: Duration = Duration::from_secs(20);

/// The master may keep a result waiting for others to come in.
const RETURN_PATIENCE: Duration = Duration::from_secs(600);

/// The way to the master; clones share the connection.
#[derive(Clone)]
pub(super) struct Master(WorkerServiceClient<Authorized>);

impl Master {
    pub(super) fn new(channel: Authorized) -> Self {
        Self(
            WorkerServiceClient::new(channel)
                .max_decoding_message_size(MAX_MESSAGE_BYTES)
                .max_encoding_message_size(MAX_MESSAGE_BYTES),
        )
    }

    pub(super) async fn join(&self, offer: &Offer) -> Result<JoinResponse, Status> {
        let request = JoinRequest {
            name: offer.name.clone(),
            threads: offer.threads,
            memory_bytes: offer.memory_bytes,
            kernel: kernel().to_owned(),
        };
        Ok(self
            .0
            .clone()
            .join(within(PATIENCE, request))
            .await?
            .into_inner())
    }

    /// Waits for a job.
    pub(super) async fn lease(
        &self,
        worker_id: u64,
        held_blocks: Vec<Vec<u8>>,
    ) -> Result<lease_response::Answer, Status> {
        let request = LeaseRequest {
            worker_id,
            wait_s: WAIT.as_secs_f64(),
            held_blocks,
        };
        let answer = self
            .0
            .clone()
            .lease(within(WAIT + PATIENCE, request))
            .await?;
        let answer = answer.into_inner().answer;
        answer.ok_or_else(|| Status::internal("lease without answer"))
    }

    pub(super) async fn renew(
        &self,
        worker_id: u64,
        lease_ids: Vec<u64>,
    ) -> Result<Vec<u64>, Status> {
        let request = RenewRequest {
            worker_id,
            lease_ids,
        };
        let answer = self.0.clone().renew(within(PATIENCE, request)).await?;
        Ok(answer.into_inner().unwanted_lease_ids)
    }

    /// An encoded block of that many bytes, which are checked to be the ones that were asked for.
    pub(super) async fn fetch(
        &self,
        worker_id: u64,
        block_id: &[u8],
        block_bytes: usize,
    ) -> Result<Vec<u8>, Status> {
        let request = FetchBlockRequest {
            worker_id,
            block_id: block_id.to_vec(),
        };
        let mut stream = self.0.clone().fetch_block(request).await?.into_inner();
        let mut bytes = Vec::with_capacity(block_bytes);
        loop {
            let part = tokio::time::timeout(PATIENCE, stream.message())
                .await
                .map_err(|_| Status::deadline_exceeded("the block stopped coming"))??;
            match part.map(|m| m.part) {
                Some(Some(fetch_block_response::Part::TotalBytes(total))) => {
                    if total != block_bytes as u64 {
                        let text = format!("block of {total} bytes, expected {block_bytes}");
                        return Err(Status::data_loss(text));
                    }
                }
                Some(Some(fetch_block_response::Part::Chunk(chunk))) => {
                    if chunk.len() > block_bytes - bytes.len() {
                        return Err(Status::data_loss("block is longer than announced"));
                    }
                    bytes.extend_from_slice(&chunk);
                }
                Some(None) => return Err(Status::data_loss("expected a chunk")),
                None => break,
            }
        }
        if blake3::hash(&bytes).as_bytes()[..] != *block_id {
            return Err(Status::data_loss("block is not the one that was asked for"));
        }
        Ok(bytes)
    }

    pub(super) async fn return_rows(
        &self,
        header: RowsHeader,
        packed: Bytes,
    ) -> Result<bool, Status> {
        let chunks: Vec<Bytes> = (0..packed.len())
            .step_by(SLICE_BYTES)
            .map(|at| packed.slice(at..(at + SLICE_BYTES).min(packed.len())))
            .collect();
        let parts = std::iter::once(return_rows_request::Part::Header(header))
            .chain(chunks.into_iter().map(return_rows_request::Part::Chunk))
            .map(|part| ReturnRowsRequest { part: Some(part) });
        let request = within(RETURN_PATIENCE, tokio_stream::iter(parts));
        let answer = self.0.clone().return_rows(request).await?;
        Ok(answer.into_inner().used)
    }

    pub(super) async fn give_back(&self, request: GiveBackRequest) -> Result<(), Status> {
        self.0.clone().give_back(within(PATIENCE, request)).await?;
        Ok(())
    }

    pub(super) async fn leave(&self, worker_id: u64) -> Result<(), Status> {
        let request = within(PATIENCE, LeaveRequest { worker_id });
        self.0.clone().leave(request).await?;
        Ok(())
    }
}

/// The same call again, for as long as the master cannot be reached, or is busy.
pub(super) async fn again<T, F: Future<Output = Result<T, Status>>>(
    mut call: impl FnMut() -> F,
) -> Result<T, Status> {
    let mut pause = FIRST_PAUSE;
    loop {
        match call().await {
            Err(status) if may_pass(&status) => {
                tracing::warn!(reason = reason::of(&status), "trying again in {pause:?}");
                tokio::time::sleep(pause).await;
                pause = (2 * pause).min(LAST_PAUSE);
            }
            answer => return answer,
        }
    }
}

fn may_pass(status: &Status) -> bool {
    matches!(
        status.code(),
        Code::Unavailable
            | Code::Unknown
            | Code::DeadlineExceeded
            | Code::Cancelled
            | Code::ResourceExhausted
            | Code::Internal
            | Code::Aborted
    )
}

fn within<T>(time: Duration, message: T) -> Request<T> {
    let mut request = Request::new(message);
    request.set_timeout(time);
    request
}
