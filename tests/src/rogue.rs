//! A worker whose every call a test decides on.

use std::net::SocketAddr;
use std::time::Duration;

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

use crate::lies::Pairs;
use crate::processes::PATIENCE;

/// A worker that has joined.
pub struct Rogue {
    runtime: Runtime,
    client: WorkerServiceClient<Channel>,
    /// Its number.
    pub id: u64,
}

/// A request to join that a master takes.
pub fn honest_join() -> JoinRequest {
    JoinRequest {
        name: "rogue".to_owned(),
        threads: 4,
        memory_bytes: 1 << 33,
        kernel: nestrad_kernel::kernel().to_owned(),
    }
}

impl Rogue {
    /// Joins a master.
    pub fn join(master: SocketAddr) -> Self {
        Self::join_as(master, honest_join()).unwrap()
    }

    /// Joins a master, or is turned away.
    pub fn join_as(master: SocketAddr, request: JoinRequest) -> Result<Self, Status> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .unwrap();
        let url = format!("http://{master}");
        let endpoint = Endpoint::try_from(url).unwrap();
        let channel = runtime.block_on(endpoint.connect()).unwrap();
        let mut client = WorkerServiceClient::new(channel);
        let joined = runtime.block_on(client.join(request))?;
        let id = joined.into_inner().worker_id;
        Ok(Self {
            runtime,
            client,
            id,
        })
    }

    fn call<T>(&self, call: impl Future<Output = Result<T, Status>>) -> Result<T, Status> {
        let bounded = async { tokio::time::timeout(PATIENCE, call).await };
        self.runtime.block_on(bounded).expect("an answer in time")
    }

    /// Gets a job.
    pub fn lease(&self) -> LeasedJob {
        loop {
            let request = LeaseRequest {
                worker_id: self.id,
                wait_s: 10.0,
                held_blocks: Vec::new(),
            };
            let answer = self.call(self.client.clone().lease(request)).unwrap();
            match answer.into_inner().answer {
                Some(lease_response::Answer::Job(job)) => return job,
                Some(lease_response::Answer::Nothing(_)) => {}
                other => panic!("{other:?}"),
            }
        }
    }

    /// Computes jobs until the master wants no more of it: `lie` is told the number of each. Gives how many were taken.
    pub fn serve(&self, mut lie: impl FnMut(usize, &mut Pairs)) -> usize {
        let mut taken = 0;
        loop {
            let request = LeaseRequest {
                worker_id: self.id,
                wait_s: 1.0,
                held_blocks: Vec::new(),
            };
            let leased = self.call(self.client.clone().lease(request));
            let job = match leased.map(|answer| answer.into_inner().answer) {
                Ok(Some(lease_response::Answer::Job(job))) => job,
                Ok(Some(lease_response::Answer::Nothing(_))) => continue,
                _ => return taken,
            };
            let Ok((header, packed)) = self.lie(&job, |pairs| lie(taken, pairs)) else {
                return taken;
            };
            taken += usize::from(self.bring(&header, &packed).unwrap_or(false));
        }
    }

    /// Computes a job, as it should.
    pub fn compute(&self, job: &LeasedJob) -> (RowsHeader, Vec<u8>) {
        self.lie(job, |_| ()).unwrap()
    }

    /// Computes a job, and makes its rows other than they should be.
    pub fn lie(
        &self,
        job: &LeasedJob,
        lie: impl FnOnce(&mut Pairs),
    ) -> Result<(RowsHeader, Vec<u8>), Status> {
        let request = FetchBlockRequest {
            worker_id: self.id,
            block_id: job.block_id.clone(),
        };
        let bytes = self.call(async {
            let mut stream = self.client.clone().fetch_block(request).await?.into_inner();
            let mut bytes = Vec::new();
            while let Some(message) = stream.message().await? {
                match message.part.unwrap() {
                    fetch_block_response::Part::TotalBytes(n) => assert_eq!(n, job.block_bytes),
                    fetch_block_response::Part::Chunk(chunk) => {
                        assert!(chunk.len() <= 1 << 20);
                        bytes.extend_from_slice(&chunk);
                    }
                }
            }
            Ok(bytes)
        });
        let message = v1::Block::decode(&bytes?[..]).unwrap();
        let block = near_field::block(&message).unwrap();
        let tracer = nestrad_kernel::Tracer::new(&block);
        let batch = near_field::batch(job.batch.as_ref().unwrap());
        let rows = nestrad_kernel::trace(&block, || &tracer, &batch).packed(&block);
        let shape = Shape {
            rows: block.rows() as u32,
            ends: block.ends() as u32,
        };
        let mut pairs = Pairs::of(&rows.packed, shape);
        lie(&mut pairs);
        let (packed, entries) = pairs.packed(shape);
        let header = RowsHeader {
            worker_id: self.id,
            lease_id: job.lease_id,
            packed_bytes: packed.len() as u64,
            checksum: blake3::hash(&packed).as_bytes().to_vec(),
            rows: shape.rows,
            entries,
            lines: rows.counts.lines,
            segments: rows.counts.segments,
            rays: rows.counts.rays,
            compute_s: 0.1,
        };
        Ok((header, packed))
    }

    /// Returns a result; whether it was of use.
    pub fn bring(&self, header: &RowsHeader, packed: &[u8]) -> Result<bool, Status> {
        let mut parts = vec![return_rows_request::Part::Header(header.clone())];
        for chunk in packed.chunks(1 << 19) {
            parts.push(return_rows_request::Part::Chunk(chunk.to_vec().into()));
        }
        self.send(parts)
    }

    /// Sends any messages as a result.
    pub fn send(&self, parts: Vec<return_rows_request::Part>) -> Result<bool, Status> {
        let messages = parts
            .into_iter()
            .map(|part| ReturnRowsRequest { part: Some(part) });
        let stream = tokio_stream::iter(messages.collect::<Vec<_>>());
        let answer = self.call(self.client.clone().return_rows(stream))?;
        Ok(answer.into_inner().used)
    }

    /// Begins to return a result of which a byte comes every two seconds, for as long as the master bears with it.
    pub fn drip(&self, header: RowsHeader) {
        let (sender, messages) = mpsc::channel(1);
        self.runtime.spawn(async move {
            let mut part = return_rows_request::Part::Header(header);
            while sender
                .send(ReturnRowsRequest { part: Some(part) })
                .await
                .is_ok()
            {
                tokio::time::sleep(Duration::from_secs(2)).await;
                part = return_rows_request::Part::Chunk(vec![1].into());
            }
        });
        let mut client = self.client.clone();
        self.runtime.spawn(async move {
            // refused or given up: it does not matter to who wants to be in the way
            let _ = client.return_rows(ReceiverStream::new(messages)).await;
        });
    }

    /// Says that it goes.
    pub fn leave(&self) {
        let request = LeaveRequest { worker_id: self.id };
        self.call(self.client.clone().leave(request)).unwrap();
    }

    /// A heartbeat; gives the leases that are not wanted.
    pub fn renew(&self, lease_ids: Vec<u64>) -> Result<Vec<u64>, Status> {
        let request = RenewRequest {
            worker_id: self.id,
            lease_ids,
        };
        let answer = self.call(self.client.clone().renew(request))?;
        Ok(answer.into_inner().unwanted_lease_ids)
    }

    /// Gives a job back as failed.
    pub fn fail(&self, job: &LeasedJob, reason: &str) {
        let request = GiveBackRequest {
            worker_id: self.id,
            lease_id: job.lease_id,
            reason: reason.to_owned(),
            failed: true,
        };
        self.call(self.client.clone().give_back(request)).unwrap();
    }
}
