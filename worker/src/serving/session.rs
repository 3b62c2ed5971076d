//! From joining a master to leaving it.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use nestrad_proto::near_field;
use nestrad_proto::v1::{GiveBackRequest, JoinResponse, LeasedJob, lease_response};
use rayon::ThreadPool;
use tokio::sync::watch;
use tokio::task::JoinSet;
use tonic::{Code, Status};

use super::blocks::Blocks;
use super::calls::{Master, again};
use super::slot::{self, Computed};

/// How a session ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    /// The master has nothing more to do.
    Drained,
    /// The worker was told to stop.
    Stopped,
    /// The master does not know the worker any more.
    Lost,
}

/// How long a worker that leaves waits for the master to hear of it.
const LEAVING: Duration = Duration::from_secs(2);

pub(super) struct Session {
    master: Master,
    blocks: Arc<Blocks>,
    worker_id: u64,
    heartbeat: Duration,
    /// Leases that are held.
    leases: Mutex<BTreeSet<u64>>,
    /// Memory that it was said to lack, bytes.
    needs_bytes: AtomicU64,
}

impl Session {
    pub(super) fn new(master: Master, blocks: Arc<Blocks>, joined: &JoinResponse) -> Arc<Self> {
        let heartbeat = Duration::try_from_secs_f64(joined.heartbeat_s).unwrap_or_default();
        Arc::new(Self {
            master,
            blocks,
            worker_id: joined.worker_id,
            heartbeat: heartbeat.clamp(Duration::from_millis(10), Duration::from_secs(3600)),
            leases: Mutex::default(),
            needs_bytes: AtomicU64::new(0),
        })
    }

    /// Computes jobs, one a pool, until there are no more, or until `stop` becomes true: then for no
    /// longer than `grace`.
    pub(super) async fn run(
        self: Arc<Self>,
        pools: &[Arc<ThreadPool>],
        stop: watch::Receiver<bool>,
        grace: Duration,
    ) -> End {
        let mut slots = JoinSet::new();
        for pool in pools {
            slots.spawn(self.clone().slot(pool.clone(), stop.clone()));
        }
        let mut stopped = stop;
        let out_of_time = async {
            // an error says that nobody can tell it to stop any more
            if stopped.wait_for(|stop| *stop).await.is_err() {
                std::future::pending::<()>().await;
            }
            tokio::time::sleep(grace).await;
        };
        let all_slots = async {
            let mut end = End::Drained;
            while let Some(slot) = slots.join_next().await {
                match slot {
                    Ok(Ok(End::Drained)) => {}
                    Ok(Ok(other)) => end = other,
                    Ok(Err(Lost)) | Err(_) => return End::Lost,
                }
            }
            end
        };
        let end = tokio::select! {
            end = all_slots => end,
            end = self.heartbeats() => end,
            () = out_of_time => End::Stopped,
        };
        if end != End::Lost {
            // leases that are left go to others at once
            let left = tokio::time::timeout(LEAVING, self.master.leave(self.worker_id)).await;
            if !matches!(left, Ok(Ok(()))) {
                tracing::warn!("left, but could not tell the master");
            }
        }
        end
    }

    /// Renews all leases, for ever: no computing can hold this up.
    async fn heartbeats(&self) -> End {
        let mut beat = tokio::time::interval(self.heartbeat);
        beat.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
        loop {
            beat.tick().await;
            let leases = self.lock().iter().copied().collect();
            match self.master.renew(self.worker_id, leases).await {
                Ok(unwanted) => {
                    let mut held = self.lock();
                    for lease in unwanted {
                        held.remove(&lease);
                    }
                }
                Err(status) if status.code() == Code::NotFound => return End::Lost,
                Err(status) => tracing::warn!(reason = status.message(), "heartbeat failed"),
            }
        }
    }

    /// Leases and computes one job after the other. While one is computed, the one before it is on its
    /// way back.
    async fn slot(
        self: Arc<Self>,
        pool: Arc<ThreadPool>,
        stop: watch::Receiver<bool>,
    ) -> Result<End, Lost> {
        let mut returning: JoinSet<Result<(), Lost>> = JoinSet::new();
        let end = loop {
            let job = match self.next(stop.clone()).await? {
                Next::Job(job) => job,
                Next::End(end) => break end,
            };
            let lease = job.lease_id;
            self.lock().insert(lease);
            let computed = self.compute(&pool, *job).await?;
            if let Some(before) = returning.join_next().await {
                before.map_err(|_| Lost)??;
            }
            match computed {
                // a result that nobody waits for is not sent
                Ok(computed) if self.lock().contains(&lease) => {
                    returning.spawn(self.clone().bring(lease, computed));
                }
                Ok(_) => {}
                Err(reason) => self.give_back(lease, reason).await?,
            }
        };
        while let Some(last) = returning.join_next().await {
            last.map_err(|_| Lost)??;
        }
        Ok(end)
    }

    async fn next(&self, mut stop: watch::Receiver<bool>) -> Result<Next, Lost> {
        loop {
            let asked = again(|| self.master.lease(self.worker_id, self.blocks.ids()));
            let answer = tokio::select! {
                // a lease that is on its way goes to others when the worker leaves
                Ok(_) = stop.wait_for(|stop| *stop) => return Ok(Next::End(End::Stopped)),
                answer = asked => answer,
            };
            match answer {
                Ok(lease_response::Answer::Job(job)) => return Ok(Next::Job(Box::new(job))),
                Ok(lease_response::Answer::Nothing(nothing)) => {
                    self.lacks_memory(nothing.needs_memory_bytes);
                }
                Ok(lease_response::Answer::Drain(_)) => return Ok(Next::End(End::Drained)),
                Err(status) => return Err(lost(&status)),
            }
        }
    }

    /// The master has no job for a worker with so little memory: says so, once.
    fn lacks_memory(&self, needs_bytes: u64) {
        const GIB: f64 = (1u64 << 30) as f64;
        let known = self.needs_bytes.swap(needs_bytes, Ordering::Relaxed);
        if needs_bytes > 0 && needs_bytes != known {
            let needs = needs_bytes as f64 / GIB;
            tracing::warn!(
                "idle: the smallest block needs {needs:.2} GiB of memory: give this worker more --memory, or \
                 fewer --threads"
            );
        }
    }

    async fn compute(
        &self,
        pool: &ThreadPool,
        job: LeasedJob,
    ) -> Result<Result<Computed, String>, Lost> {
        let block = match self.blocks.get(&self.master, self.worker_id, &job).await {
            Ok(block) => block,
            Err(status) if status.code() == Code::NotFound => return Err(Lost),
            Err(status) => return Ok(Err(status.message().to_owned())),
        };
        let batch = near_field::batch(&job.batch.unwrap_or_default());
        Ok(slot::compute(pool, block.ready(), batch).await)
    }

    /// Returns the rows of a job.
    async fn bring(self: Arc<Self>, lease: u64, mut computed: Computed) -> Result<(), Lost> {
        computed.header.worker_id = self.worker_id;
        computed.header.lease_id = lease;
        let bring = || {
            self.master
                .return_rows(computed.header.clone(), computed.packed.clone())
        };
        let brought = again(bring).await;
        self.lock().remove(&lease);
        match brought {
            Ok(used) => tracing::debug!(lease, used, "returned"),
            Err(status) if status.code() == Code::NotFound => return Err(Lost),
            Err(status) => tracing::error!(lease, reason = status.message(), "result refused"),
        }
        Ok(())
    }

    async fn give_back(&self, lease: u64, reason: String) -> Result<(), Lost> {
        tracing::error!(lease, reason, "job failed");
        let request = GiveBackRequest {
            worker_id: self.worker_id,
            lease_id: lease,
            reason,
            failed: true,
        };
        let given = again(|| self.master.give_back(request.clone())).await;
        self.lock().remove(&lease);
        given.map_err(|status| lost(&status))
    }

    fn lock(&self) -> MutexGuard<'_, BTreeSet<u64>> {
        // the set is whole at any time
        self.leases.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The master does not know the worker any more.
#[derive(Clone, Copy, Debug)]
struct Lost;

/// What a slot does next.
enum Next {
    Job(Box<LeasedJob>),
    End(End),
}

/// A call that must not fail has: the worker is as good as unknown.
fn lost(status: &Status) -> Lost {
    if status.code() != Code::NotFound {
        tracing::error!(reason = status.message(), "the master refuses a call");
    }
    Lost
}
