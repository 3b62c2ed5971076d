//! `nestrad serve`: the master as a service.

use std::net::SocketAddr;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use nestrad_cluster::WorkerLimits;
use nestrad_common::threads::Threads;
use nestrad_proto::access::Access;
use nestrad_proto::connections::{ConnectionLimits, Connections};
use nestrad_proto::log::Log;
use nestrad_proto::parent::end_with_stdin;
use nestrad_service::server::{Service, ServiceLimits};
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};

use super::numbers::{not_negative, positive, whole};
use super::state::StateFlags;
use super::workers::{fraction, lease};

/// Serve solves to clients over gRPC until it is stopped
///
/// Clients are `nestrad solve --master` and programs in any language; see docs/operators.md. On SIGTERM or
/// Ctrl-C the master accepts nothing new, finishes the running solves (see --drain), hands out their results
/// and exits with code 0. It logs to stderr; NESTRAD_LOG sets the level (debug, info, warn).
#[derive(Debug, Args)]
pub(crate) struct ServeArgs {
    /// Address for clients and workers; port 0 is any free port
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7410")]
    listen: SocketAddr,

    /// Exit when stdin closes, whatever is running: for a parent process that may end without notice
    #[arg(long)]
    with_stdin: bool,

    #[command(flatten)]
    access: Access,

    /// After this many seconds of silence, the jobs of a worker go to others
    #[arg(long, value_name = "SECONDS", default_value = "30", value_parser = lease)]
    lease: Duration,

    /// After this many seconds without results from workers, the master computes by itself
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = lease)]
    patience: Duration,

    /// The share of the workers' jobs that the master computes again, to see whether they are right: 0 to 1. Of
    /// every worker one job of a solve at least; 0 is none
    #[arg(long, value_name = "FRACTION", default_value_t = 0.01, value_parser = fraction, allow_negative_numbers = true)]
    audit: f64,

    #[command(flatten)]
    state: StateFlags,

    #[command(flatten)]
    limits: LimitFlags,

    /// Address where Prometheus reads metrics, over plain HTTP at /metrics [default: none]
    #[arg(long, value_name = "ADDRESS:PORT")]
    metrics: Option<SocketAddr>,
}

#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = "Limits")]
struct LimitFlags {
    /// Number of threads, 0 for one per processor; at most 4 for each processor are used
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u16>(0..=4096), allow_negative_numbers = true)]
    threads: u16,

    /// Solves that are computed at the same time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u8>(1..=255), allow_negative_numbers = true)]
    solves: u8,

    /// Solves that may wait; of one client, half of what the others leave
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = whole::<u32>(0..=u32::MAX.into()), allow_negative_numbers = true)]
    queue: u32,

    /// Memory that one solve may take, GiB
    #[arg(long, value_name = "GIB", default_value_t = 8.0, value_parser = positive)]
    memory: f64,

    /// Memory for scenes that are held, GiB; where it is full, the client with the most loses the scene that it did not
    /// use for longest
    #[arg(long, value_name = "GIB", default_value_t = 4.0, value_parser = positive)]
    scene_memory: f64,

    /// Memory for canopies that stay traced after a solve, GiB; the longest unused makes room for others. Another
    /// light or other optics trace nothing then. 0 is none
    #[arg(long, value_name = "GIB", default_value_t = 2.0, value_parser = not_negative, allow_negative_numbers = true)]
    resident_memory: f64,

    /// Memory for results that are held, GiB; where it is full, new solves are refused until results were fetched
    #[arg(long, value_name = "GIB", default_value_t = 4.0, value_parser = positive)]
    result_memory: f64,

    /// Seconds that running solves have to finish when the master is stopped; then they are cancelled
    #[arg(long, value_name = "SECONDS", default_value_t = 30, value_parser = whole::<u32>(0..=u32::MAX.into()), allow_negative_numbers = true)]
    drain: u32,
}

impl LimitFlags {
    fn limits(self) -> ServiceLimits {
        let bytes = |GiB: f64| (GiB * (1u64 << 30) as f64) as u64;
        ServiceLimits {
            scene_bytes: bytes(self.scene_memory),
            result_bytes: bytes(self.result_memory),
            resident_bytes: bytes(self.resident_memory),
            solve_GiB: self.memory,
            solves: self.solves.into(),
            queue: self.queue as usize,
            drain_s: self.drain.into(),
        }
    }
}

impl ServeArgs {
    pub(crate) fn run(self) -> Result<()> {
        let _log = Log::begin("NESTRAD_LOG")?;
        if self.with_stdin {
            end_with_stdin().context("cannot start threads")?;
        }
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .context("cannot start threads")?;
        runtime.block_on(self.serve())
    }

    async fn serve(self) -> Result<()> {
        // before anything listens: a signal that comes early is not lost
        let mut terminate = signal(SignalKind::terminate()).context("cannot wait for signals")?;
        let mut interrupt = signal(SignalKind::interrupt()).context("cannot wait for signals")?;
        let shutdown = async move {
            tokio::select! {
                _ = terminate.recv() => {}
                _ = interrupt.recv() => {}
            }
        };
        let workers = WorkerLimits {
            patience: self.patience,
            audit: self.audit,
            ..WorkerLimits::default().with_lease(self.lease)
        };
        // before anything is begun that would have to wait
        let connections = Connections::new(ConnectionLimits::default().within_open_files());
        let server = self.access.server(self.listen, &connections)?;
        let kept = self.state.open(|warning| tracing::warn!("{warning}"))?;
        let threads = Threads::asked(self.limits.threads.into());
        if let Some(warning) = &threads.warning {
            tracing::warn!("{warning}");
        }
        let service = Service::new(
            self.limits.limits(),
            workers,
            kept,
            threads.count,
            connections,
        )?;
        let listener = bind(self.listen).await?;
        if let Some(address) = self.metrics {
            let listener = bind(address).await?;
            tracing::info!(address = %listener.local_addr()?, "metrics");
            service.serve_metrics(listener);
        }
        service.run(listener, server, shutdown).await?;
        tracing::info!("stopped");
        Ok(())
    }
}

async fn bind(address: SocketAddr) -> Result<TcpListener> {
    let listener = TcpListener::bind(address).await;
    listener.with_context(|| format!("cannot listen on {address}"))
}
