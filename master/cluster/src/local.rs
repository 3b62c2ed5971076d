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
        let mut children = Vec::new();
        for k in 0..share.workers {
            let started = command(&program, door, share, k).spawn();
            match started {
                Ok(child) => children.push(child),
                Err(source) => {
                    stop(children, Duration::ZERO);
                    return Err(LocalError::Start { program, source });
                }
            }
        }
        let (end, ended) = mpsc::channel();
        let cluster = door.cluster().clone();
        let watching = thread::spawn(move || {
            let mut told = false;
            while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(PAUSE) {
                let lives = children
                    .iter_mut()
                    .any(|child| matches!(child.try_wait(), Ok(None)));
                if !lives && !told {
                    told = true;
                    let n = children.len();
                    cluster.desert(&format!("all {n} worker processes have ended"));
                }
            }
            stop(children, FAREWELL);
        });
        Ok(Self {
            end: Some(end),
            watching: Some(watching),
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

/// Ends processes: those that do not end in time by themselves are killed.
fn stop(mut children: Vec<Child>, patience: Duration) {
    let begun = Instant::now();
    for child in &mut children {
        drop(child.stdin.take());
    }
    loop {
        children.retain_mut(|child| matches!(child.try_wait(), Ok(None)));
        if children.is_empty() || begun.elapsed() >= patience {
            break;
        }
        thread::sleep(PAUSE / 5);
    }
    for child in &mut children {
        // it may have ended just now
        let _ = child.kill();
        let _ = child.wait();
    }
}
