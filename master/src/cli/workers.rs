//! The options that say who computes.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use anyhow::Result;
use clap::Args;
use nestrad_cluster::door::Door;
use nestrad_cluster::local::{LocalWorkers, Share};
use nestrad_cluster::{Cluster, WorkerLimits};
use nestrad_common::threads::{self, FOR_EACH_PROCESSOR, Threads};
use nestrad_engine::causes::causes;
use nestrad_engine::plan::Plan;
use nestrad_proto::access::Access;

use super::console::Notes;
use super::numbers::whole;

#[derive(Debug, Args)]
#[command(next_help_heading = "Workers")]
pub(crate) struct WorkersFlags {
    /// Number of worker processes to start on this machine; they share --threads, and the part of --memory that
    /// this process does not need
    #[arg(long, value_name = "N", conflicts_with = "listen",
          value_parser = whole::<u32>(1..=1024), allow_negative_numbers = true)]
    workers: Option<u32>,

    /// Address where workers can join this solve, any number at any time: `nestrad-worker --master
    /// http://ADDRESS:PORT`
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,

    /// After this many seconds of silence, the jobs of a worker go to others
    #[arg(long, value_name = "SECONDS", default_value = "30", value_parser = lease)]
    lease: Duration,

    /// After this many seconds without results from workers, this process computes by itself
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = lease)]
    patience: Duration,

    /// The share of the workers' jobs that this process computes again, to see whether they are right: 0 to 1. Of
    /// every worker one job at least; 0 is none
    #[arg(long, value_name = "FRACTION", default_value_t = 0.01, value_parser = fraction, allow_negative_numbers = true)]
    audit: f64,

    #[command(flatten)]
    access: Access,
}

/// Those who compute a solve, besides this process.
pub(crate) struct Crew {
    // in the order in which they are dropped: who asks for a job is told to leave through the door
    door: Door,
    local: Option<Local>,
    notes: Notes,
}

/// Worker processes on this machine.
struct Local {
    /// How many are asked for, with the threads and the memory of all, this process included.
    wanted: Share,
    running: Mutex<Option<(Share, LocalWorkers)>>,
}

/// A worker with less memory than this is not worth starting, GiB.
const LEAST_OF_A_WORKER: f64 = 0.08;

impl Crew {
    pub(crate) fn cluster(&self) -> &Cluster {
        self.door.cluster()
    }

    /// Starts as many workers for a round as there is memory for beside what this process needs for it. Those that
    /// are there already stay, unless they may take more than that.
    pub(crate) fn begin_round(&self, plan: &Plan) {
        let Some(local) = &self.local else { return };
        let left_GiB = local.wanted.memory_GiB - plan.memory.total_GiB();
        let room = (left_GiB / LEAST_OF_A_WORKER).max(0.0) as u32;
        let share = Share {
            workers: local.wanted.workers.min(room),
            memory_GiB: left_GiB,
            ..local.wanted
        };
        let mut running = local.running.lock().unwrap_or_else(PoisonError::into_inner);
        let stays = |(now, _): &(Share, LocalWorkers)| {
            now.workers >= share.workers && now.memory_GiB <= left_GiB
        };
        if running.as_ref().is_some_and(stays) {
            return;
        }
        drop(running.take());
        self.cluster().set_alone(share.workers == 0);
        if share.workers < local.wanted.workers {
            let line = format!(
                "{} of {} are started: --memory has no room for more",
                share.workers, local.wanted.workers
            );
            self.notes.say("workers", &line);
        }
        if share.workers == 0 {
            return;
        }
        match LocalWorkers::start(&self.door, share) {
            Ok(workers) => *running = Some((share, workers)),
            Err(error) => self.cluster().desert(&causes(&error)),
        }
    }
}

impl WorkersFlags {
    /// Opens the door for workers, if any are asked for. To be called where the work is done.
    pub(crate) fn crew(&self, memory_GiB: f64, notes: Notes) -> Result<Option<Crew>> {
        if self.workers.is_none() && self.listen.is_none() {
            return Ok(None);
        }
        let here = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let threads = rayon::current_num_threads();
        let limits = WorkerLimits {
            patience: self.patience,
            audit: self.audit,
            ..WorkerLimits::default().with_lease(self.lease)
        };
        let door = Door::open(self.listen.unwrap_or(here), &self.access, limits, threads)?;
        if self.listen.is_some() {
            notes.say("workers", &format!("may join at {}", door.address()));
        }
        let local = self.workers.map(|workers| Local {
            wanted: Share {
                workers: at_most(workers, notes),
                threads: threads as u32,
                memory_GiB,
            },
            running: Mutex::default(),
        });
        Ok(Some(Crew { door, local, notes }))
    }
}

/// A part of the whole.
pub(super) fn fraction(text: &str) -> Result<f64, String> {
    let part = text.parse().ok().filter(|part| (0.0..=1.0).contains(part));
    part.ok_or_else(|| "expected a number from 0 to 1".to_owned())
}

/// As many workers as there may be for the processors of this machine; says so where more were asked for.
fn at_most(workers: u32, notes: Notes) -> u32 {
    let most = Threads::asked(workers as usize);
    if most.warning.is_some() {
        let processors = threads::processors();
        let line = format!(
            "{workers} workers are more than {FOR_EACH_PROCESSOR} for each of {processors} processors: {} are started",
            most.count
        );
        notes.say("warning", &line);
    }
    most.count as u32
}

/// A lease time, or patience.
pub(super) fn lease(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().filter(|s| (0.1..=86_400.0).contains(s));
    let seconds = seconds.ok_or_else(|| "expected seconds, 0.1 to 86400".to_owned())?;
    Ok(Duration::from_secs_f64(seconds))
}
