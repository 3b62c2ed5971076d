//! `nestrad solve --master`: the same solve, computed elsewhere.

use std::sync::Arc;

use anyhow::{Context, Result};
use clap::Args;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_engine::progress::{Progress, StageProgress};
use nestrad_proto::channel::{self, Credentials};
use nestrad_service::client::{self, Event, SolvedThere};
use tokio::signal::unix::{SignalKind, signal};

use super::bar::Bar;
use super::console::Notes;

/// Where to compute.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Where to compute it")]
pub(crate) struct MasterFlags {
    /// Compute at this master (http://HOST:PORT or https://HOST:PORT) [default: here]
    ///
    /// Files are read, checked and written here. The results are the same to the last bit.
    #[arg(long, value_name = "URL", conflicts_with = "threads")]
    pub(crate) master: Option<String>,

    #[command(flatten)]
    credentials: Credentials,
}

impl MasterFlags {
    /// Solves at the master `url`; Ctrl-C and SIGTERM cancel the solve there.
    pub(crate) fn solve(
        &self,
        url: &str,
        scene: Scene,
        settings: &Settings,
        notes: Notes,
    ) -> Result<SolvedThere> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .context("cannot start threads")?;
        runtime.block_on(async {
            let mut terminate = signal(SignalKind::terminate()).context("no signals")?;
            let mut interrupt = signal(SignalKind::interrupt()).context("no signals")?;
            let stop = async move {
                tokio::select! {
                    _ = terminate.recv() => {}
                    _ = interrupt.recv() => {}
                }
            };
            let master = client::client(channel::connect(url, &self.credentials)?);
            let progress = Arc::new(Progress::default());
            let _bar = Bar::of(&progress, notes.quiet);
            let mut last = StageProgress::default();
            let tell = |event| match event {
                Event::Plan(line) => notes.say("plan", &line),
                Event::Note(line) => notes.say("note", &line),
                Event::Stage(now) => {
                    if (&now.name, now.total) != (&last.name, last.total) {
                        progress.stage(&now.name, now.total);
                        last = StageProgress::default();
                    }
                    progress.inc(now.done.saturating_sub(last.done));
                    last = now;
                }
            };
            let solved = client::solve(master, scene, settings, tell, stop).await;
            solved.with_context(|| format!("master {url}"))
        })
    }
}
