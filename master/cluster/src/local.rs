//! Worker processes on this machine, for one solve.

use std::env;
use std::io;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use thiserror::Error;

use crate::door::Door;

/// How often it is looked whether they live.
const PAUSE: Duration = Duration::from_millis(100);

/// How long they may take to end by themselves.
const FAREWELL: Duration = Duration::from_secs(5);

/// Workers that end with the solve, and with this process, however that ends: they hold its end of a pipe.
pub struct LocalWorkers {
    end: Option<mpsc::Sender<()>>,
    watching: Option<JoinHandle<()>>,
}

/// What is shared out among the workers.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    /// Number of workers, at least 1.
    pub workers: u32,
    /// Threads of all of them.
    pub threads: u32,
    /// Memory of all of them, GiB.
    pub memory_GiB: f64,
}

/// Why workers cannot be started.
#[derive(Debug, Error)]
pub enum LocalError {
    /// The program is not there.
    #[error("cannot start {}", program.display())]
    Start {
        /// The worker's program.
        program: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// There is no thread to look after them.
    #[error("cannot start a thread for the worker processes")]
    Thread(#[source] io::Error),
    /// This program's place is not known.
    #[error("cannot find nestrad-worker")]
    Place(#[source] io::Error),
}

impl LocalWorkers {
    /// Starts workers that come in through a door: the program `nestrad-worker` beside this one.
    pub fn start(door: &Door, share: Share) -> Result<Self, LocalError> {
        let program = env::current_exe()
            .map_err(LocalError::Place)?
            .with_file_name("nestrad-worker");
        Self::start_program(program, door, share, thread::Builder::new())
    }

    /// ... on a thread that looks after them.
    fn start_program(
        program: PathBuf,
        door: &Door,
        share: Share,
        watcher: thread::Builder,
    ) -> Result<Self, LocalError> {
        // dropped, they end: also where no thread can be had
        let mut children = Children(Vec::new());
        for k in 0..share.workers {
            let started = command(&program, door, share, k).spawn();
            match started {
                Ok(child) => children.0.push(child),
                Err(source) => return Err(LocalError::Start { program, source }),
            }
        }
        let (end, ended) = mpsc::channel();
        let cluster = door.cluster().clone();
        let watching = watcher.spawn(move || {
            let mut told = false;
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(PAUSE) {
                if !children.any_lives() && !told {
                    told = true;
                    let n = children.0.len();
                    cluster.desert(&format!("all {n} worker processes have ended"));
                }
            }
            children.end(FAREWELL);
        });
        Ok(Self {
            end: Some(end),
            watching: Some(watching.map_err(LocalError::Thread)?),
        })
    }
}

impl Drop for LocalWorkers {
    fn drop(&mut self) {
        drop(self.end.take());
        if let Some(watching) = self.watching.take() {
            // a panic there has been shown
            let _ = watching.join();
        }
    }
}

fn command(program: &PathBuf, door: &Door, share: Share, k: u32) -> Command {
    let more = u32::from(k < share.threads % share.workers);
    let threads = (share.threads / share.workers + more).max(1);
    let mut command = Command::new(program);
    command
        .arg("--master")
        .arg(format!("http://{}", door.address()))
        .arg("--threads")
        .arg(threads.to_string())
        .arg("--memory")
        .arg((share.memory_GiB / f64::from(share.workers)).to_string())
        .arg("--name")
        .arg(format!("local {k}"))
        .arg("--with-stdin")
        .stdin(Stdio::piped())
        .stdout(Stdio::null());
    if env::var_os("RUST_LOG").is_none() {
        command.env("RUST_LOG", "error");
    }
    command
}

/// Processes that end with this.
struct Children(Vec<Child>);

impl Children {
    fn any_lives(&mut self) -> bool {
        self.0
            .iter_mut()
            .any(|child| matches!(child.try_wait(), Ok(None)))
    }

    /// Ends all: those that do not end in time by themselves are killed.
    fn end(&mut self, patience: Duration) {
        let begun = Instant::now();
        for child in &mut self.0 {
            drop(child.stdin.take());
        }
        while self.any_lives() && begun.elapsed() < patience {
            thread::sleep(PAUSE / 5);
        }
        for mut child in self.0.drain(..) {
            // it may have ended by itself
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Drop for Children {
    fn drop(&mut self) {
        self.end(Duration::ZERO);
    }
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, SocketAddr};

    use nestrad_proto::access::Access;

    use super::*;
    use crate::cluster::WorkerLimits;

    #[test]
    fn a_thread_that_cannot_be_had_is_an_error() {
        let here = SocketAddr::from((Ipv4Addr::LOCALHOST, 0));
        let (access, limits) = (Access::default(), WorkerLimits::default());
        let door = Door::open(here, &access, limits, 1).expect("a door of this machine");
        let share = Share {
            workers: 2,
            threads: 2,
            memory_GiB: 1.0,
        };
        // no machine has so much memory
        let watcher = thread::Builder::new().stack_size(1 << 60);
        let started = LocalWorkers::start_program("true".into(), &door, share, watcher);
        assert!(matches!(started, Err(LocalError::Thread(_))));
    }
}
