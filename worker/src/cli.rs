//! The command line of a worker.

use std::fs;
use std::io::Write;
use std::process::ExitCode;

use anyhow::{Context, Result};
use clap::Parser;
use nestrad_common::threads::{MOST_THREADS, Threads};
use nestrad_proto::channel::{Credentials, connect};
use nestrad_proto::log::Log;
use nestrad_proto::parent::end_with_stdin;
use nestrad_proto::usage;
use tokio::runtime::Builder;
use tokio::signal::unix::{SignalKind, signal};
use tokio::sync::watch;

use crate::serving::{Offer, serve};

/// Computes near-field jobs for a nestrad master.
///
/// It connects to the master, and can join and leave at any time. On SIGTERM or Ctrl-C it finishes its jobs or
/// gives them back, and exits. It logs to stderr; RUST_LOG sets the level.
#[derive(Debug, Parser)]
#[command(name = "nestrad-worker", version)]
pub(crate) struct Cli {
    /// The master: http://HOST:PORT or https://HOST:PORT
    #[arg(long, value_name = "URL")]
    master: String,

    /// Number of threads, each with one job at a time; 0 for one per processor, at most 4 for each
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = threads, allow_negative_numbers = true)]
    threads: u32,

    /// Memory that the worker may take, GiB [default: three quarters of the free memory of the machine]
    #[arg(long, value_name = "GIB", value_parser = positive)]
    memory: Option<f64>,

    /// Name of this worker at the master [default: the host's name]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,

    /// Exit when stdin closes: for a parent process that may end without notice
    #[arg(long)]
    with_stdin: bool,

    #[command(flatten)]
    credentials: Credentials,
}

impl Cli {
    pub(crate) fn run() -> ExitCode {
        let cli = match Self::try_parse() {
            Ok(cli) => cli,
            Err(error) => {
                usage::say(&error);
                return u8::try_from(error.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from);
            }
        };
        let _log = match Log::begin("RUST_LOG") {
            Ok(log) => log,
            Err(error) => {
                // nothing can be done about a stderr that is gone
                let _ = writeln!(std::io::stderr(), "error: {error}");
                return ExitCode::FAILURE;
            }
        };
        match cli.serve() {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                tracing::error!("{error:#}");
                ExitCode::FAILURE
            }
        }
    }

    fn serve(self) -> Result<()> {
        // calls and heartbeats have threads of their own, next to those that compute
        let runtime = Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .context("cannot start threads")?;
        runtime.block_on(async {
            let offer = self.offer();
            let (stop, stopped) = watch::channel(false);
            let mut terminate = signal(SignalKind::terminate()).context("no SIGTERM")?;
            let mut interrupt = signal(SignalKind::interrupt()).context("no SIGINT")?;
            tokio::spawn(async move {
                tokio::select! {
                    _ = terminate.recv() => {}
                    _ = interrupt.recv() => {}
                }
                tracing::info!("told to stop");
                // nobody listens where it has stopped already
                let _ = stop.send(true);
            });
            if self.with_stdin {
                end_with_stdin().context("cannot start threads")?;
            }
            let channel = connect(&self.master, &self.credentials)?;
            serve(channel, offer, stopped).await?;
            tracing::info!("left");
            Ok(())
        })
    }

    fn offer(&self) -> Offer {
        const GIB: f64 = (1u64 << 30) as f64;
        let threads = Threads::asked(self.threads as usize);
        if let Some(warning) = &threads.warning {
            tracing::warn!("{warning}");
        }
        let memory = self.memory.map(|gib| (gib * GIB) as u64);
        Offer {
            name: self.name.clone().unwrap_or_else(host_name),
            threads: threads.count as u32,
            memory_bytes: memory.unwrap_or_else(|| free_memory_bytes() / 4 * 3),
        }
    }
}

fn host_name() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let name = name.trim();
    format!(
        "{}:{}",
        if name.is_empty() { "worker" } else { name },
        std::process::id()
    )
}

/// What the machine has free, and what the control group allows, whichever is less.
fn free_memory_bytes() -> u64 {
    let meminfo = fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let available = meminfo.lines().find_map(|line| {
        let kib = line
            .strip_prefix("MemAvailable:")?
            .trim()
            .strip_suffix("kB")?;
        kib.trim().parse::<u64>().ok()
    });
    let allowed = fs::read_to_string("/sys/fs/cgroup/memory.max").ok();
    let allowed = allowed.and_then(|text| text.trim().parse::<u64>().ok());
    let least = available.map_or(4 << 30, |kib| kib << 10);
    allowed.map_or(least, |bytes| bytes.min(least))
}

fn threads(text: &str) -> Result<u32, String> {
    let number = text
        .parse()
        .ok()
        .filter(|number| *number <= MOST_THREADS as u32);
    number.ok_or_else(|| "expected a whole number from 0 to 4096".to_owned())
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok();
    let number = number.filter(|value: &f64| value.is_finite() && *value > 0.0);
    number.ok_or_else(|| "expected a number above 0".to_owned())
}
