//! A worker at a master that may go at any time: each call is answered or fails.

use std::future::Future;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use nestrad_kernel::packed::Shape;
use nestrad_proto::near_field;
use nestrad_proto::v1::worker_service_client::WorkerServiceClient;
use nestrad_proto::v1::{
    self, FetchBlockRequest, GiveBackRequest, JoinRequest, LeaseRequest, LeasedJob, LeaveRequest,
    RenewRequest, ReturnRowsRequest, RowsHeader, fetch_block_response, lease_response,
    return_rows_request,
};
use prost::Message;
use tokio::runtime::{Builder, Runtime};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Status;
use tonic::transport::{Channel, Endpoint};

/// No answer is waited for longer.
const ANSWER: Duration = Duration::from_secs(60);

/// A worker that has joined.
pub(crate) struct Visitor {
    runtime: Runtime,
    client: WorkerServiceClient<Channel>,
    id: u64,
}

impl Visitor {
    /// Joins a master.
    pub(crate) fn join(master: SocketAddr, request: JoinRequest) -> Result<Self, Status> {
        let own = |error: std::io::Error| Status::internal(error.to_string());
        let runtime = Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(own)?;
        let joins = async {
            let endpoint = Endpoint::try_from(format!("http://{master}"));
            let endpoint = endpoint.map_err(|error| Status::internal(error.to_string()))?;
            let channel = endpoint.connect().await;
            let channel = channel.map_err(|error| Status::unavailable(error.to_string()))?;
            let mut client = WorkerServiceClient::new(channel);
            let id = client.join(request).await?.into_inner().worker_id;
            Ok((client, id))
        };
        let (client, id) = runtime.block_on(bounded(joins))?;
        Ok(Self {
            runtime,
            client,
            id,
        })
    }

    fn call<T>(&self, call: impl Future<Output = Result<T, Status>>) -> Result<T, Status> {
        self.runtime.block_on(bounded(call))
    }

    /// Asks for a job; none may come within the time.
    pub(crate) fn ask(&self, wait_s: f64) -> Result<Option<LeasedJob>, Status> {
        let request = LeaseRequest {
            worker_id: self.id,
            wait_s,
            held_blocks: Vec::new(),
        };
        let answer = self.call(self.client.clone().lease(request))?;
        match answer.into_inner().answer {
            Some(lease_response::Answer::Job(job)) => Ok(Some(job)),
            Some(lease_response::Answer::Drain(_)) => Err(Status::unavailable("told to leave")),
            _ => Ok(None),
        }
    }

    /// Computes a job as it should; gives the shape of its rows too.
    pub(crate) fn compute(&self, job: &LeasedJob) -> Result<(RowsHeader, Vec<u8>, Shape), Status> {
        let wrong = |fault: &dyn ToString| Status::data_loss(fault.to_string());
        let bytes = self.call(self.fetch(job))?;
        let message = v1::Block::decode(&bytes[..]).map_err(|fault| wrong(&fault))?;
        let block = near_field::block(&message).map_err(|fault| wrong(&fault))?;
        let batch = job.batch.as_ref().ok_or_else(|| wrong(&"no batch"))?;
        let tracer = nestrad_kernel::Tracer::new(&block);
        let rows = nestrad_kernel::trace(&block, || &tracer, &near_field::batch(batch));
        let rows = rows.packed(&block);
        let shape = Shape {
            rows: block.rows() as u32,
            ends: block.ends() as u32,
        };
        let header = RowsHeader {
            worker_id: self.id,
            lease_id: job.lease_id,
            packed_bytes: rows.packed.len() as u64,
            checksum: blake3::hash(&rows.packed).as_bytes().to_vec(),
            rows: shape.rows,
            entries: rows.counts.row_entries,
            lines: rows.counts.lines,
            segments: rows.counts.segments,
            rays: rows.counts.rays,
            compute_s: 0.1,
        };
        Ok((header, rows.packed, shape))
    }

    async fn fetch(&self, job: &LeasedJob) -> Result<Vec<u8>, Status> {
        let request = FetchBlockRequest {
            worker_id: self.id,
            block_id: job.block_id.clone(),
        };
        let mut stream = self.client.clone().fetch_block(request).await?.into_inner();
        let mut bytes = Vec::new();
        while let Some(message) = stream.message().await? {
            if let Some(fetch_block_response::Part::Chunk(chunk)) = message.part {
                bytes.extend_from_slice(&chunk);
            }
        }
        Ok(bytes)
    }

    /// Returns a result; whether it was of use.
    pub(crate) fn bring(&self, header: &RowsHeader, packed: &[u8]) -> Result<bool, Status> {
        let mut parts = vec![return_rows_request::Part::Header(header.clone())];
        for chunk in packed.chunks(1 << 19) {
            parts.push(return_rows_request::Part::Chunk(chunk.to_vec().into()));
        }
        let messages = parts.into_iter().map(message).collect::<Vec<_>>();
        let stream = tokio_stream::iter(messages);
        let answer = self.call(self.client.clone().return_rows(stream))?;
        Ok(answer.into_inner().used)
    }

    /// Sends a header, then a byte at a time, until then.
    pub(crate) fn trickle(
        &self,
        header: &RowsHeader,
        pause: Duration,
        until: Instant,
    ) -> Result<bool, Status> {
        let header = message(return_rows_request::Part::Header(header.clone()));
        let (sender, receiver) = mpsc::channel(1);
        let sends = async move {
            let mut next = header;
            while sender.send(next).await.is_ok() && Instant::now() < until {
                tokio::time::sleep(pause).await;
                next = message(return_rows_request::Part::Chunk(vec![0].into()));
            }
        };
        let answer = self.call(async {
            tokio::spawn(sends);
            let stream = ReceiverStream::new(receiver);
            self.client.clone().return_rows(stream).await
        })?;
        Ok(answer.into_inner().used)
    }

    /// A heartbeat.
    pub(crate) fn renew(&self, lease_ids: Vec<u64>) -> Result<(), Status> {
        let request = RenewRequest {
            worker_id: self.id,
            lease_ids,
        };
        self.call(self.client.clone().renew(request)).map(drop)
    }

    /// Gives a job back as failed.
    pub(crate) fn fail(&self, job: &LeasedJob, reason: &str) -> Result<(), Status> {
        let request = GiveBackRequest {
            worker_id: self.id,
            lease_id: job.lease_id,
            reason: reason.to_owned(),
            failed: true,
        };
        self.call(self.client.clone().give_back(request)).map(drop)
    }

    /// Leaves.
    pub(crate) fn leave(self) -> Result<(), Status> {
        let request = LeaveRequest { worker_id: self.id };
        self.call(self.client.clone().leave(request)).map(drop)
    }
}

fn message(part: return_rows_request::Part) -> ReturnRowsRequest {
    ReturnRowsRequest { part: Some(part) }
}

async fn bounded<T>(call: impl Future<Output = Result<T, Status>>) -> Result<T, Status> {
    let answer = tokio::time::timeout(ANSWER, call).await;
    answer.unwrap_or_else(|_| Err(Status::deadline_exceeded("no answer in time")))
}
