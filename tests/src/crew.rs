//! Solves that workers join, and the workers: processes that go when these do.

use std::net::SocketAddr;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex};

use crate::processes::{PATIENCE, follow, nestrad, program, signal, until};

/// A process whose stderr is read.
pub struct Process {
    child: Child,
    log: Arc<Mutex<String>>,
    lines: Receiver<String>,
}

impl Process {
    /// Starts a program.
    pub fn start(mut command: Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let (log, lines) = follow(child.stderr.take().unwrap());
        Self { child, log, lines }
    }

    /// Waits until it says something; gives the whole line.
    pub fn says(&self, what: &str) -> String {
        loop {
            let line = self.lines.recv_timeout(PATIENCE);
            let line = line.unwrap_or_else(|_| panic!("never said '{what}': {}", self.log()));
            if line.contains(what) {
                return line;
            }
        }
    }

    /// All that it said so far.
    pub fn log(&self) -> String {
        self.log.lock().unwrap().clone()
    }

    /// Sends it a signal.
    pub fn signal(&self, name: &str) {
        signal(self.child.id(), name);
    }

    /// Waits until it ends.
    pub fn ends(&mut self) -> ExitStatus {
        let mut status = None;
        until("a process ends", || {
            status = self.child.try_wait().unwrap();
            status.is_some()
        });
        status.unwrap()
    }

    /// The processes that it has started and that live.
    pub fn children(&self) -> Vec<u32> {
        let id = self.child.id();
        let tasks = std::fs::read_dir(format!("/proc/{id}/task")).unwrap();
        let of = |task: std::fs::DirEntry| std::fs::read_to_string(task.path().join("children"));
        let listed = tasks.filter_map(|task| of(task.ok()?).ok());
        let listed: Vec<String> = listed.collect();
        let ids = listed.iter().flat_map(|ids| ids.split_whitespace());
        ids.map(|id| id.parse().unwrap()).collect()
    }

    /// Memory of the process at its peak, bytes; `None` once it has ended.
    pub fn peak_bytes(&self) -> Option<u64> {
        let status = format!("/proc/{}/status", self.child.id());
        let status = std::fs::read_to_string(status).ok()?;
        let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
        let kib = line.trim().strip_suffix("kB")?;
        Some(1024 * kib.trim().parse::<u64>().ok()?)
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // it may have ended already
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// `nestrad solve --listen`.
pub struct Solving {
    /// The process.
    pub process: Process,
    /// Where workers may join.
    pub address: SocketAddr,
}

impl Solving {
    /// Begins a solve of `scene` with leases of a second.
    pub fn begin(folder: &Path, scene: &str, out: &str, more: &[&str]) -> Self {
        let here = "127.0.0.1:0";
        let args = [
            "solve", scene, "--out", out, "--listen", here, "--lease", "1",
        ];
        let process = Process::start(nestrad(folder, &[&args, more].concat()));
        let line = process.says("may join at ");
        let (_, address) = line.split_once("may join at ").unwrap();
        let address = address.trim().parse().unwrap();
        Self { process, address }
    }

    /// Waits for its end, which must be a good one.
    pub fn succeeds(&mut self) {
        let status = self.process.ends();
        assert!(status.success(), "{}", self.process.log());
    }
}

/// `nestrad-worker` with one thread.
pub fn worker(master: SocketAddr, more: &[&str]) -> Process {
    let mut command = Command::new(program("nestrad-worker"));
    command
        .arg("--master")
        .arg(format!("http://{master}"))
        .args(["--threads", "1"])
        .args(more)
        .env_remove("NESTRAD_TOKEN")
        .env("RUST_LOG", "info")
        .env("NO_COLOR", "1");
    Process::start(command)
}
