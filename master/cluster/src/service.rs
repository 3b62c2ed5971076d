//! What workers call.

use std::hash::BuildHasher;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use bytes::Bytes;
use nestrad_common::panics;
use nestrad_engine::exchange::JobRows;
use nestrad_proto::MAX_MESSAGE_BYTES;
use nestrad_proto::v1::worker_service_server::{WorkerService, WorkerServiceServer};
use nestrad_proto::v1::{
    Drain, FetchBlockRequest, GiveBackRequest, GiveBackResponse, JoinRequest, JoinResponse,
    LeaseRequest, LeaseResponse, LeasedJob, LeaveRequest, LeaveResponse, Nothing, RenewRequest,
    RenewResponse, ReturnRowsRequest, ReturnRowsResponse, RowsHeader, lease_response,
    return_rows_request,
};
use tokio::sync::oneshot;
use tonic::{Request, Response, Status, Streaming};

use crate::cluster::{Brought, Cluster, ClusterState};
use crate::receive::{self, Wanted};
use crate::scheduler::{BlockId, Id, Leased, Refusal, WorkerFacts};
use crate::seen::Seen;
use crate::sending::Sending;

/// Longest wait for a job.
const LONGEST_WAIT: Duration = Duration::from_secs(30);

/// Limits on what a worker says of itself.
const LONGEST_NAME: usize = 128;
const LONGEST_REASON: usize = 1024;
const MOST_THREADS: u32 = 4096;
const MOST_HELD_BLOCKS: usize = 4096;

/// The worker service of a cluster.
pub struct Service(Cluster);

/// The service that the workers of a cluster call.
pub fn worker_service(cluster: Cluster) -> WorkerServiceServer<Service> {
    WorkerServiceServer::new(Service(cluster))
        .max_decoding_message_size(MAX_MESSAGE_BYTES)
        .max_encoding_message_size(MAX_MESSAGE_BYTES)
}

impl From<Refusal> for Status {
    fn from(refusal: Refusal) -> Self {
        let text = refusal.to_string();
        match refusal {
            Refusal::UnknownWorker(_) => Self::not_found(text),
            Refusal::UnknownLease(_) => Self::permission_denied(text),
            Refusal::TooMany(_) => Self::resource_exhausted(text),
        }
    }
}

#[tonic::async_trait]
impl WorkerService for Service {
    async fn join(&self, request: Request<JoinRequest>) -> Result<Response<JoinResponse>, Status> {
        let seen = Seen::of(&request);
        let asked = request.into_inner();
        let facts = facts(&asked, &seen)?;
        let kernel = nestrad_kernel::kernel();
        if asked.kernel != kernel {
            return Err(Status::failed_precondition(format!(
                "kernel is '{}', this master's is '{kernel}': results would differ",
                shown(&asked.kernel, LONGEST_NAME)
            )));
        }
        let cluster = &self.0;
        let limits = &cluster.0.limits;
        let mut state = cluster.lock();
        if state.refused.contains(&facts.who) {
            let text = format!("worker {} returned wrong rows", facts.who);
            return Err(Status::failed_precondition(text));
        }
        if state.scheduler.facts().count() >= limits.workers {
            let text = format!("expected at most {} workers", limits.workers);
            return Err(Status::resource_exhausted(text));
        }
        tracing::info!(name = %facts.name, threads = facts.threads, "worker joins");
        let worker_id = state.scheduler.join(cluster.now(), facts);
        drop(state);
        cluster.0.joined.notify_all();
        Ok(Response::new(JoinResponse {
            worker_id,
            lease_s: limits.rules.lease.as_secs_f64(),
            heartbeat_s: limits.heartbeat.as_secs_f64(),
        }))
    }

    async fn lease(
        &self,
        request: Request<LeaseRequest>,
    ) -> Result<Response<LeaseResponse>, Status> {
        let asked = request.into_inner();
        if asked.held_blocks.len() > MOST_HELD_BLOCKS {
            return Err(Status::invalid_argument("too many held_blocks"));
        }
        let held: Result<Vec<BlockId>, _> = asked
            .held_blocks
            .into_iter()
            .map(BlockId::try_from)
            .collect();
        let held = held.map_err(|_| Status::invalid_argument("held_blocks: expected 32 bytes"))?;
        let wait = Duration::try_from_secs_f64(asked.wait_s).unwrap_or_default();
        let until = tokio::time::Instant::now() + wait.min(LONGEST_WAIT);
        let cluster = &self.0;
        let answer = loop {
            // from here on no change is missed
            let changed = cluster.0.changed.notified();
            tokio::pin!(changed);
            changed.as_mut().enable();
            if let Some(answer) = cluster.lease_now(asked.worker_id, &held)? {
                break answer;
            }
            let (needs, is_news) = cluster.too_small(asked.worker_id);
            let is_over = || tokio::time::timeout_at(until, changed);
            if is_news || is_over().await.is_err() {
                let nothing = Nothing {
                    needs_memory_bytes: needs,
                };
                break lease_response::Answer::Nothing(nothing);
            }
        };
        Ok(Response::new(LeaseResponse {
            answer: Some(answer),
        }))
    }

    type FetchBlockStream = Sending;

    async fn fetch_block(
        &self,
        request: Request<FetchBlockRequest>,
    ) -> Result<Response<Self::FetchBlockStream>, Status> {
        let asked = request.into_inner();
        let cluster = &self.0;
        let bytes = {
            let now = cluster.now();
            let mut state = cluster.lock();
            state.scheduler.renew(now, asked.worker_id, &[])?;
            state.block(&asked.block_id)
        };
        let Some(bytes) = bytes else {
            return Err(Status::failed_precondition("no solve has this block"));
        };
        let size = bytes.len() as u64;
        cluster
            .0
            .totals
            .bytes_out
            .fetch_add(size, Ordering::Relaxed);
        Ok(Response::new(cluster.0.turns.send(bytes).await))
    }

    async fn renew(
        &self,
        request: Request<RenewRequest>,
    ) -> Result<Response<RenewResponse>, Status> {
        let asked = request.into_inner();
        let most = 2 * MOST_THREADS as usize;
        if asked.lease_ids.len() > most {
            let text = format!("lease_ids: expected at most {most}");
            return Err(Status::invalid_argument(text));
        }
        let now = self.0.now();
        let mut state = self.0.lock();
        let unwanted = state
            .scheduler
            .renew(now, asked.worker_id, &asked.lease_ids)?;
        Ok(Response::new(RenewResponse {
            unwanted_lease_ids: unwanted,
        }))
    }

    async fn return_rows(
        &self,
        request: Request<Streaming<ReturnRowsRequest>>,
    ) -> Result<Response<ReturnRowsResponse>, Status> {
        let used = self.0.take_rows(request.into_inner()).await?;
        Ok(Response::new(ReturnRowsResponse { used }))
    }

    async fn give_back(
        &self,
        request: Request<GiveBackRequest>,
    ) -> Result<Response<GiveBackResponse>, Status> {
        let asked = request.into_inner();
        let reason = shown(&asked.reason, LONGEST_REASON);
        let failure = asked.failed.then_some(reason.as_str());
        self.0
            .given_back(asked.worker_id, asked.lease_id, failure)?;
        Ok(Response::new(GiveBackResponse {}))
    }

    async fn leave(
        &self,
        request: Request<LeaveRequest>,
    ) -> Result<Response<LeaveResponse>, Status> {
        let worker = request.into_inner().worker_id;
        let now = self.0.now();
        self.0.lock().scheduler.leave(now, worker);
        self.0.0.changed.notify_waiters();
        tracing::info!("worker leaves");
        Ok(Response::new(LeaveResponse {}))
    }
}

impl ClusterState {
    fn block(&self, id: &[u8]) -> Option<Bytes> {
        let mut blocks = self.solves.values().flat_map(|open| open.blocks.iter());
        blocks.find(|b| b.id == *id).map(|b| b.bytes.clone())
    }
}

impl Cluster {
    fn lease_now(
        &self,
        worker: Id,
        held: &[BlockId],
    ) -> Result<Option<lease_response::Answer>, Status> {
        let now = self.now();
        let mut state = self.lock();
        if state.closed {
            return Err(Status::unavailable("the master stops"));
        }
        if state.draining {
            return Ok(Some(lease_response::Answer::Drain(Drain {})));
        }
        let leased = state.scheduler.lease(now, worker, held)?;
        let job = leased.and_then(|leased| {
            let open = state.solves.get(&leased.solve)?;
            let block = &open.blocks[leased.block];
            Some(LeasedJob {
                lease_id: leased.lease,
                block_id: block.id.to_vec(),
                block_bytes: block.bytes.len() as u64,
                batch: open.batches.get(leased.job).cloned(),
                block_memory_bytes: block.demand.block_bytes(),
                making_memory_bytes: block.demand.making_bytes(),
                job_memory_bytes: block.demand.job_bytes(),
            })
        });
        Ok(job.map(lease_response::Answer::Job))
    }

    /// Memory that the smallest block needs of a worker that has less, bytes, and whether it does not know yet; 0
    /// where it has enough.
    fn too_small(&self, worker: Id) -> (u64, bool) {
        const GIB: f64 = (1u64 << 30) as f64;
        let mut state = self.lock();
        let Some((needs, is_news)) = state.scheduler.tell_too_small(worker) else {
            return (0, false);
        };
        if is_news && let Some(facts) = state.scheduler.facts_of(worker) {
            let remark = format!(
                "worker '{}' is idle: the smallest block needs {:.2} GiB of its memory, it has {:.2} GiB",
                facts.name,
                needs as f64 / GIB,
                facts.memory_bytes as f64 / GIB
            );
            state.remark(remark);
        }
        (needs, is_news)
    }

    fn given_back(&self, worker: Id, lease: Id, failure: Option<&str>) -> Result<(), Status> {
        let now = self.now();
        if let Some(reason) = failure {
            tracing::warn!(lease, reason, "near-field job failed");
        }
        let given = self.lock().scheduler.give_back(now, worker, lease, failure);
        self.0.changed.notify_waiters();
        match given {
            // it is back already
            Ok(()) | Err(Refusal::UnknownLease(_)) => Ok(()),
            Err(refusal) => Err(refusal.into()),
        }
    }

    /// A result: let in, checked, and handed on. Whether it was of use.
    async fn take_rows(&self, mut stream: Streaming<ReturnRowsRequest>) -> Result<bool, Status> {
        let patience = self.0.limits.rules.lease;
        let first = receive::next(&mut stream, patience).await?;
        let Some(return_rows_request::Part::Header(header)) = first else {
            return Err(Status::invalid_argument("expected a header"));
        };
        let (worker, lease) = (header.worker_id, header.lease_id);
        let wanted = self.wanted(worker, lease)?;
        let Some(wanted) = wanted else {
            return Ok(false);
        };
        let taken = async {
            receive::check_header(&header, &wanted)?;
            let (said, of) = (header.clone(), wanted.clone());
            let expected = self.compute(move || of.job(&said)).await?;
            let mut coming = self.0.room.enter(header.packed_bytes).await?;
            let body = receive::body(&mut stream, &header, &mut coming, patience).await?;
            let bytes = body.len() as u64;
            self.0.totals.bytes_in.fetch_add(bytes, Ordering::Relaxed);
            let cluster = self.clone();
            self.compute(move || {
                let rows = receive::check_body(&header, body, &expected)?;
                cluster.look_again(&header, &wanted, &rows)?;
                Ok(cluster.hand_on(&header, rows))
            })
            .await
        };
        let taken: Result<bool, Status> = taken.await;
        if let Err(status) = &taken
            && receive::is_fault(status)
        {
            self.0.totals.refused.fetch_add(1, Ordering::Relaxed);
            self.given_back(worker, lease, Some(status.message()))?;
        }
        taken
    }

    /// Has something computed where rows are checked.
    async fn compute<T: Send + 'static>(
        &self,
        what: impl FnOnce() -> Result<T, Status> + Send + 'static,
    ) -> Result<T, Status> {
        let (sender, done) = oneshot::channel();
        self.0.compute.spawn(move || {
            // a fault of the program is that of this result, not the end of the master
            let fault = |panic| Err(Status::internal(format!("internal fault: {panic}")));
            let done = panics::caught(what).unwrap_or_else(fault);
            // nobody listens where the worker is gone
            let _ = sender.send(done);
        });
        let gone = |_| Status::internal("result was not checked");
        done.await.map_err(gone)?
    }

    /// Traces a few lines again, by chance; a worker that says other than what they see is refused.
    fn look_again(
        &self,
        header: &RowsHeader,
        wanted: &Wanted,
        rows: &JobRows,
    ) -> Result<(), Status> {
        let JobRows::Packed(packed) = rows else {
            return Ok(());
        };
        let number = |k: u32| self.0.key.hash_one((header.lease_id, k));
        if wanted.is_seen_again(&packed.packed, self.0.limits.audit, number) {
            return Ok(());
        }
        let mut state = self.lock();
        let of = state
            .scheduler
            .wanted(self.now(), header.worker_id, header.lease_id);
        let facts = state.scheduler.facts_of(header.worker_id);
        let who = facts.map(|facts| facts.who.clone());
        if let (Ok(Some(of)), Some(who)) = (of, who) {
            let results = state.solves.get(&of.solve).map(|open| open.results.clone());
            drop(state);
            self.refuse(&who);
            if let Some(results) = results {
                // nobody listens where the solve has failed
                let _ = results.send(Err(who));
            }
        }
        let text = "result without what its lines see";
        Err(Status::failed_precondition(text))
    }

    fn wanted(&self, worker: Id, lease: Id) -> Result<Option<Wanted>, Status> {
        let now = self.now();
        let mut state = self.lock();
        let wanted: Option<Leased> = state.scheduler.wanted(now, worker, lease)?;
        Ok(wanted.and_then(|leased| {
            let open = state.solves.get(&leased.solve)?;
            Some(Wanted {
                scene: open.scene.clone(),
                parts: open.parts.clone(),
                block: leased.block,
                known: open.blocks[leased.block].known.clone(),
                batch: open.batches.get(leased.job)?.clone(),
                cost_s: *open.costs_s.get(leased.job)?,
                most_bytes: self.0.room.most_bytes(),
            })
        }))
    }

    /// Gives a good result to its solve.
    fn hand_on(&self, header: &RowsHeader, rows: JobRows) -> bool {
        let (worker, lease, compute_s) = (header.worker_id, header.lease_id, header.compute_s);
        let now = self.now();
        let totals = &self.0.totals;
        let add = |total: &AtomicU64, more: u64| total.fetch_add(more, Ordering::Relaxed);
        let counts = rows.counts();
        let mut state = self.lock();
        let leased = state.scheduler.finish(now, worker, lease, compute_s);
        let who = state
            .scheduler
            .facts_of(worker)
            .map(|facts| facts.who.clone());
        if let Some(leased) = leased
            && let Some(open) = state.solves.get(&leased.solve)
            && let Some(worker) = who
            && let Ok(checksum) = <[u8; 32]>::try_from(&header.checksum[..])
        {
            add(&totals.results, 1);
            add(&totals.segments, counts.segments);
            add(&totals.rays, counts.rays);
            // nobody listens where the solve has failed
            let _ = open.results.send(Ok(Brought {
                job: leased.job,
                rows,
                worker,
                checksum,
            }));
        }
        leased.is_some()
    }
}

fn facts(asked: &JoinRequest, seen: &Seen) -> Result<WorkerFacts, Status> {
    if asked.name.len() > LONGEST_NAME {
        let text = format!("name: expected at most {LONGEST_NAME} bytes");
        return Err(Status::invalid_argument(text));
    }
    if !(1..=MOST_THREADS).contains(&asked.threads) {
        let text = format!("threads: expected 1 to {MOST_THREADS}");
        return Err(Status::invalid_argument(text));
    }
    let name = shown(&asked.name, LONGEST_NAME);
    Ok(WorkerFacts {
        identity: seen.identity(&asked.name),
        who: seen.who(&name),
        name,
        threads: asked.threads,
        memory_bytes: asked.memory_bytes,
    })
}

/// What a worker wrote, cut short and without what would upset a terminal.
fn shown(text: &str, longest: usize) -> String {
    let mut left = longest;
    text.chars()
        .map(|c| if c.is_control() { '?' } else { c })
        .take_while(|c| {
            let fits = c.len_utf8() <= left;
            left = left.saturating_sub(c.len_utf8());
            fits
        })
        .collect()
}
