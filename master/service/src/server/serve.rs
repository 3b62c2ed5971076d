//! The service on a socket: its health, what it can do, and how it stops.

use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use axum::http::header::{CONNECTION, CONTENT_TYPE};
use axum::routing::get;
use nestrad_cluster::store::Store;
use nestrad_cluster::{Cluster, WorkerLimits, worker_service};
use nestrad_proto::access::GuardedServer;
use nestrad_proto::connections::Connections;
use nestrad_proto::v1::solve_service_server::SolveServiceServer;
use nestrad_proto::{DESCRIPTORS, MAX_MESSAGE_BYTES};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use thiserror::Error;
use tokio::net::TcpListener;
use tokio::time::{sleep, timeout};
use tonic_health::server::HealthReporter;

use super::admission::Bounds;
use super::compute::{self, Means};
use super::limits::ServiceLimits;
use super::metrics::{Metrics, Now};
use super::metrics_port::MetricsPort;
use super::residents::Residents;
use super::rpc::Rpc;
use super::scenes::Scenes;
use super::solve::Phase;
use super::solves::Solves;
use super::supervisor::{Fault, Supervisor};
use super::uploads::Uploads;

/// Time for clients to come for what has just finished, and to hang up, when the master stops.
const FAREWELL: Duration = Duration::from_secs(5);

/// A master that serves clients.
#[derive(Clone, Debug)]
pub struct Service {
    limits: ServiceLimits,
    scenes: Arc<Scenes>,
    solves: Arc<Solves>,
    residents: Arc<Residents>,
    metrics: Arc<Metrics>,
    pool: Arc<ThreadPool>,
    workers: Cluster,
    kept: Option<Store>,
    connections: Connections,
    supervisor: Supervisor,
    started: Instant,
}

/// The task that looks after the workers.
const WATCH: &str = "watch";

/// The task that gives out metrics.
const METRICS: &str = "metrics";

/// Why a master does not serve.
#[derive(Debug, Error)]
pub enum ServeError {
    /// Threads cannot be started.
    #[error("cannot start threads")]
    Threads(#[from] ThreadPoolBuildError),
    /// The system refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The description of the services is broken.
    #[error("cannot describe the services")]
    Reflection(#[from] tonic_reflection::server::Error),
    /// The server failed.
    #[error("cannot serve")]
    Transport(#[from] tonic::transport::Error),
    /// It stopped because a part of it had ended.
    #[error(transparent)]
    Fault(#[from] Fault),
}

impl Service {
    /// A master that computes with so many threads as long as there are no workers. To be called within a tokio
    /// runtime.
    pub fn new(
        limits: ServiceLimits,
        workers: WorkerLimits,
        kept: Option<Store>,
        threads: usize,
        connections: Connections,
    ) -> Result<Self, ServeError> {
        let named = |k| format!("compute-{k}");
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(named)
            .build()?;
        let bounds = Bounds {
            queue: limits.queue,
            result_bytes: limits.result_bytes,
            scene_bytes: limits.scene_bytes,
        };
        let (workers, supervisor) = (Cluster::new(workers, threads)?, Supervisor::default());
        supervisor.task(WATCH, workers.keep_watch());
        Ok(Self {
            limits,
            scenes: Arc::new(Scenes::new(limits.scene_bytes)),
            solves: Arc::new(Solves::new(bounds, limits.solves.max(1))),
            residents: Arc::new(Residents::new(limits.resident_bytes)),
            metrics: Arc::default(),
            pool: Arc::new(pool),
            workers,
            kept,
            connections,
            supervisor,
            started: Instant::now(),
        })
    }

    /// Serves the connections that it was made with until `shutdown` comes, or a part of the master ends; and then until what is being computed is done and
    /// fetched, or the time for that is over.
    pub async fn run(
        &self,
        listener: TcpListener,
        mut server: GuardedServer,
        shutdown: impl Future<Output = ()> + Send + 'static,
    ) -> Result<(), ServeError> {
        let reflection = || {
            tonic_reflection::server::Builder::configure()
                .register_encoded_file_descriptor_set(DESCRIPTORS)
                .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
        };
        let (health, health_service) = tonic_health::server::health_reporter();
        health.set_serving::<SolveServiceServer<Rpc>>().await;
        self.start_computing()?;
        let rpc = Rpc {
            scenes: self.scenes.clone(),
            solves: self.solves.clone(),
            residents: self.residents.clone(),
            metrics: self.metrics.clone(),
            uploads: Uploads::new(),
            workers: self.workers.clone(),
            most_GiB: self.limits.solve_GiB,
            started: self.started,
        };
        let clients = SolveServiceServer::new(rpc)
            .max_decoding_message_size(MAX_MESSAGE_BYTES)
            .max_encoding_message_size(MAX_MESSAGE_BYTES);
        let drained = Arc::new(tokio::sync::Notify::new());
        let (this, told) = (self.clone(), drained.clone());
        let drain = async move {
            tokio::select! {
                () = shutdown => {}
                fault = this.supervisor.first_fault() => this.give_up(&fault),
            }
            this.drain(&health).await;
            told.notify_one();
        };
        tracing::info!(address = %listener.local_addr()?, "serves");
        let serving = server
            .add_service(health_service)
            .add_service(reflection().build_v1()?)
            .add_service(reflection().build_v1alpha()?)
            .add_service(clients)
            .add_service(worker_service(self.workers.clone()))
            .serve_with_incoming_shutdown(self.connections.incoming(listener), drain);
        // who does not hang up is left behind
        let patience = async {
            drained.notified().await;
            sleep(FAREWELL).await;
        };
        tokio::select! {
            served = serving => served?,
            () = patience => {}
        }
        self.supervisor
            .fault()
            .map_or(Ok(()), |fault| Err(fault.into()))
    }

    fn start_computing(&self) -> io::Result<()> {
        for k in 0..self.limits.solves.max(1) {
            let (this, part) = (self.clone(), format!("solve-{k}"));
            let run = move || this.compute(k);
            self.supervisor.thread(part, run)?;
        }
        Ok(())
    }

    /// Solves one after the other, until the master stops.
    fn compute(&self, k: usize) {
        let means = Means {
            pool: &self.pool,
            workers: &self.workers,
            kept: self.kept.as_ref(),
            residents: &self.residents,
        };
        let may_die = || self.supervisor.may_die(&format!("solve-{k}"));
        compute::work(&self.solves, &means, &self.metrics, may_die);
    }

    /// Does without what has ended.
    fn give_up(&self, fault: &Fault) {
        // overdue leases are not taken back: the master computes by itself
        if fault.part == WATCH {
            self.workers.desert(&fault.to_string());
        }
    }

    /// Takes on nothing new, and waits for the rest.
    async fn drain(&self, health: &HealthReporter) {
        tracing::info!("stopping: the master accepts nothing new");
        health.set_not_serving::<SolveServiceServer<Rpc>>().await;
        let overall = tonic_health::ServingStatus::NotServing;
        health.set_service_status("", overall).await;
        self.solves.stop();
        let limit = Duration::from_secs(self.limits.drain_s);
        if timeout(limit, until(|| self.solves.is_idle()))
            .await
            .is_err()
        {
            tracing::warn!("solves are cancelled: the time to drain is over");
            for solve in self.solves.all() {
                self.solves.cancel(&solve);
            }
        }
        self.workers.close();
        if let Some(kept) = &self.kept {
            kept.close();
        }
        // results that nobody comes for are lost
        let quiet = until(|| self.solves.is_quiet(FAREWELL));
        let _ = timeout(limit + FAREWELL, quiet).await;
    }

    /// Serves the metrics as Prometheus reads them, at `/metrics`, one answer a connection.
    pub fn serve_metrics(&self, listener: TcpListener) {
        const OPEN_METRICS: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";
        let this = self.clone();
        let answer = move || {
            let text = this.metrics_text();
            async move { ([(CONTENT_TYPE, OPEN_METRICS), (CONNECTION, "close")], text) }
        };
        let port = MetricsPort::new(listener);
        let serving = axum::serve(port, Router::new().route("/metrics", get(answer)));
        self.supervisor.task(METRICS, serving.into_future());
    }

    fn metrics_text(&self) -> String {
        let solves = self.solves.all();
        let count =
            |of: fn(&Phase) -> bool| solves.iter().filter(|solve| of(&solve.phase())).count();
        let (traced_canopies, traced_canopy_bytes) = self.residents.count_and_bytes();
        self.metrics.text(&Now {
            queued: count(|state| matches!(state, Phase::Queued)),
            running: count(|state| matches!(state, Phase::Running)),
            ended: count(Phase::has_ended),
            scenes: self.scenes.count(),
            scene_bytes: self.scenes.bytes(),
            traced_canopies,
            traced_canopy_bytes,
            result_bytes: self.solves.result_bytes(),
            workers: self.workers.status(),
            traffic: self.connections.traffic(),
        })
    }
}

/// Polled: a master stops once.
async fn until(done: impl Fn() -> bool) {
    while !done() {
        sleep(Duration::from_millis(50)).await;
    }
}

#[cfg(test)]
#[path = "serve_tests.rs"]
mod tests;
