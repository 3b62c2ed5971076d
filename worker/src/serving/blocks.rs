//! The blocks that a worker holds, within its memory.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use nestrad_kernel::{BASE_BYTES, Block, Tracer};
use nestrad_proto::near_field;
use nestrad_proto::v1::{self, LeasedJob};
use prost::Message;
use tokio::sync::{Notify, OnceCell};
use tonic::Status;

use super::Offer;
use super::calls::{Master, again};

/// A block, ready for the kernel.
pub(super) struct Ready {
    pub(super) block: Block,
    /// Built by the first job that casts rays.
    tracer: OnceLock<Tracer>,
}

impl Ready {
    pub(super) fn tracer(&self) -> &Tracer {
        self.tracer.get_or_init(|| Tracer::new(&self.block))
    }
}

/// Blocks that are held, oldest use first.
pub(super) struct Blocks {
    /// Memory for blocks and jobs, bytes.
    limit: u64,
    threads: u64,
    held: Mutex<Vec<Held>>,
    /// A block is not used any more.
    changed: Notify,
    /// One block is made ready at a time.
    making: tokio::sync::Mutex<()>,
}

struct Held {
    id: Vec<u8>,
    bytes: u64,
    ready: Arc<OnceCell<Arc<Ready>>>,
    users: usize,
}

/// A block in use; it is not let go of before this is.
pub(super) struct InUse<'a> {
    blocks: &'a Blocks,
    id: Vec<u8>,
    ready: Arc<Ready>,
}

impl InUse<'_> {
    pub(super) fn ready(&self) -> Arc<Ready> {
        self.ready.clone()
    }
}

impl Drop for InUse<'_> {
    fn drop(&mut self) {
        self.blocks.release(&self.id);
    }
}

impl Blocks {
    pub(super) fn new(offer: &Offer) -> Self {
        Self {
            limit: offer.memory_bytes.saturating_sub(BASE_BYTES),
            threads: u64::from(offer.threads),
            held: Mutex::new(Vec::new()),
            changed: Notify::new(),
            making: tokio::sync::Mutex::new(()),
        }
    }

    /// Content of all blocks that are held.
    pub(super) fn ids(&self) -> Vec<Vec<u8>> {
        let held = self.lock();
        held.iter()
            .filter(|h| h.ready.initialized())
            .map(|h| h.id.clone())
            .collect()
    }

    /// The block of a job: fetched where it is not held yet, once there is room for it.
    pub(super) async fn get(
        &self,
        master: &Master,
        worker_id: u64,
        job: &LeasedJob,
    ) -> Result<InUse<'_>, Status> {
        let ready = loop {
            let changed = self.changed.notified();
            tokio::pin!(changed);
            changed.as_mut().enable();
            if let Some(ready) = self.reserve(job)? {
                break ready;
            }
            changed.await;
        };
        let reserved = Reserved {
            blocks: self,
            id: Some(job.block_id.clone()),
        };
        let ready = ready
            .get_or_try_init(|| async {
                let _one = self.making.lock().await;
                self.make(master, worker_id, job).await
            })
            .await?;
        Ok(reserved.into_use(ready.clone()))
    }

    /// Room for the block of a job; `None` as long as others use it.
    fn reserve(&self, job: &LeasedJob) -> Result<Option<Arc<OnceCell<Arc<Ready>>>>, Status> {
        let mut held = self.lock();
        if let Some(at) = held.iter().position(|h| h.id == job.block_id) {
            let mut known = held.remove(at);
            known.users += 1;
            let ready = known.ready.clone();
            held.push(known);
            return Ok(Some(ready));
        }
        let jobs = self.threads.saturating_mul(job.job_memory_bytes);
        let besides = job.making_memory_bytes.max(jobs);
        let needed = job
            .block_memory_bytes
            .max(job.block_bytes)
            .saturating_add(besides);
        if needed > self.limit {
            return Err(Status::resource_exhausted(format!(
                "needs {needed} bytes of memory, has {}",
                self.limit
            )));
        }
        let mut taken: u64 = held.iter().map(|h| h.bytes).sum();
        while taken + needed > self.limit {
            let Some(idle) = held.iter().position(|h| h.users == 0) else {
                return Ok(None);
            };
            taken -= held.remove(idle).bytes;
        }
        let ready = Arc::new(OnceCell::new());
        held.push(Held {
            id: job.block_id.clone(),
            bytes: job.block_memory_bytes,
            ready: ready.clone(),
            users: 1,
        });
        Ok(Some(ready))
    }

    async fn make(
        &self,
        master: &Master,
        worker_id: u64,
        job: &LeasedJob,
    ) -> Result<Arc<Ready>, Status> {
        let size = job.block_bytes as usize;
        let bytes = again(|| master.fetch(worker_id, &job.block_id, size)).await?;
        let reserved_bytes = job.block_memory_bytes;
        let made = tokio::task::spawn_blocking(move || {
            let message = v1::Block::decode(&bytes[..]).map_err(|e| e.to_string())?;
            drop(bytes);
            // packed numbers can be many more than bytes: memory is taken only as far as it was announced
            let taken_bytes = near_field::demand(&message).block_bytes();
            if taken_bytes > reserved_bytes {
                return Err(format!(
                    "block takes {taken_bytes} bytes of memory, announced were {reserved_bytes}"
                ));
            }
            near_field::block(&message).map_err(|e| e.to_string())
        });
        let made = made.await.map_err(|e| Status::aborted(e.to_string()))?;
        let block = made.map_err(Status::data_loss)?;
        tracing::info!(bytes = size, "block is ready");
        Ok(Arc::new(Ready {
            block,
            tracer: OnceLock::new(),
        }))
    }

    fn release(&self, id: &[u8]) {
        let mut held = self.lock();
        if let Some(at) = held.iter().position(|h| h.id == id) {
            held[at].users -= 1;
            // a block that did not come holds no room
            if held[at].users == 0 && !held[at].ready.initialized() {
                held.remove(at);
            }
        }
        drop(held);
        self.changed.notify_waiters();
    }

    fn lock(&self) -> MutexGuard<'_, Vec<Held>> {
        // the list is whole at any time
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Room that is given back unless the block comes.
struct Reserved<'a> {
    blocks: &'a Blocks,
    id: Option<Vec<u8>>,
}

impl<'a> Reserved<'a> {
    fn into_use(mut self, ready: Arc<Ready>) -> InUse<'a> {
        InUse {
            blocks: self.blocks,
            id: self.id.take().unwrap_or_default(),
            ready,
        }
    }
}

impl Drop for Reserved<'_> {
    fn drop(&mut self) {
        if let Some(id) = &self.id {
            self.blocks.release(id);
        }
    }
}
