//! A master, five workers and ten clients, and every few seconds something that goes wrong. Whatever does, every
//! client ends with the bytes of the undisturbed solve or with a clear error. See "Chaos run" in
//! `master/docs/operators.md`.

#![allow(clippy::print_stderr, reason = "a command that says what it found")]

mod aftermath;
mod alone;
mod bounds;
mod calls;
mod clients;
mod clock;
mod faults;
mod ground;
mod hostile_clients;
mod hostile_workers;
mod inflict;
mod lies;
mod master;
mod process;
mod record;
mod scenes;
mod trouble;
mod verdict;
mod visitor;
mod watch;
mod workers;

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;

use clients::Client;
use clock::Clock;
use faults::Deck;
use ground::Ground;
use inflict::Victims;
use master::Master;
use record::Record;
use trouble::Troubles;
use workers::Worker;

/// Runs the service for a time in which faults follow one another, and says whether all held that must.
///
/// It needs Linux, and the right to mount (root) for faults of disks.
#[derive(Debug, Parser)]
pub(crate) struct Args {
    /// How long faults go on, seconds
    seconds: u64,

    /// Decides which faults there are, and in which order
    seed: u64,

    /// Where the log of the run is written
    log: PathBuf,

    /// Only faults whose group is this (kill, term, stop, disk, partition, clock, log, hostile-worker, hostile-client),
    /// or whose name has it
    #[arg(long, value_name = "WORD")]
    only: Vec<String>,

    /// No faults whose group is this, or whose name has it
    #[arg(long, value_name = "WORD")]
    without: Vec<String>,
}

fn main() -> ExitCode {
    let args = Args::parse();
    match alone::run_here_or_inside(&args, run) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The whole run; whether all held.
fn run(args: &Args) -> io::Result<bool> {
    let record = Record::create(&args.log);
    let named = |error| io::Error::other(format!("{}: {error}", args.log.display()));
    let record = Arc::new(record.map_err(named)?);
    record.event("begins", format!("{args:?}"));
    let ground = Arc::new(Ground::lay()?);
    let clock = Arc::new(Clock::new(ground.path("clock"))?);
    let cases = Arc::new(scenes::make(&ground)?);
    for case in cases.iter() {
        record.event(
            "scene",
            format!("{}: solved alone in {:.2?}", case.name, case.took),
        );
    }
    let troubles = Arc::new(Troubles::default());
    let master = Arc::new(Master::new(&ground, &clock, &record, &troubles)?);
    master.start(args.seed.is_multiple_of(2));
    let last_end = Arc::new(Mutex::new(Instant::now()));
    let client = |number| {
        Client::new(
            number, &master, &ground, &record, &troubles, &cases, &last_end,
        )
    };
    let workers = (0..bounds::WORKERS).map(|k| Worker::new(k, &master, &clock, &record));
    let victims = Arc::new(Victims {
        workers: workers.collect(),
        clients: (0..bounds::CLIENTS).map(client).collect(),
        ground: ground.clone(),
        clock,
        record: record.clone(),
        troubles: troubles.clone(),
        master: master.clone(),
        restarts: Mutex::new(()),
    });
    victims.workers.iter().for_each(Worker::start);
    ground.out.fill()?;
    let (stop_clients, stop_watch) = (AtomicBool::new(false), AtomicBool::new(false));
    thread::scope(|scope| {
        let watching = scope.spawn(|| watch::watch(&victims, &last_end, &stop_watch));
        let solving: Vec<_> = victims
            .clients
            .iter()
            .map(|client| scope.spawn(|| client.run(args.seed, &stop_clients)))
            .collect();
        inflict(args, &victims);
        record.event("healed", "no faults any more");
        stop_clients.store(true, Ordering::SeqCst);
        let clients = solving.into_iter().map(|thread| thread.join());
        let whole = clients.filter(Result::is_err).count() == 0;
        record.check("this program is whole", whole, "a thread of it panicked");
        aftermath::check(&victims, &client(bounds::CLIENTS), &cases);
        stop_watch.store(true, Ordering::SeqCst);
        let whole = watching.join().is_ok();
        record.check("this program is whole", whole, "a thread of it panicked");
    });
    master.terminate();
    Ok(record.close())
}

/// One fault after the other, until the time is over and all are mended.
fn inflict(args: &Args, victims: &Arc<Victims>) {
    let until = Instant::now() + Duration::from_secs(args.seconds);
    let mut going = Vec::new();
    for turn in Deck::new(args.seed, &args.only, &args.without) {
        if Instant::now() + turn.pause > until {
            break;
        }
        thread::sleep(turn.pause);
        going.push(victims.inflict(turn));
    }
    thread::sleep(until.saturating_duration_since(Instant::now()));
    let failed = going.into_iter().map(|fault| fault.join());
    let whole = failed.filter(Result::is_err).count() == 0;
    let what = "this program is whole";
    victims.record.check(what, whole, "a fault panicked");
}
