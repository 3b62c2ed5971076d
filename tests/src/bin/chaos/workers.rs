//! The workers, each on a way of its own to the master.

use std::io;
use std::net::Ipv4Addr;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use nestrad_tests::proxy::Proxy;

use crate::bounds;
use crate::clock::Clock;
use crate::master::Master;
use crate::process::{Reader, Saying, ends_within, kill, lock, program, signal};
use crate::record::Record;

/// A worker, whichever process it is now.
pub(crate) struct Worker {
    number: usize,
    pub(crate) way: Proxy,
    clock: Arc<Clock>,
    record: Arc<Record>,
    process: Mutex<Option<(Child, Arc<Saying>)>>,
}

impl Worker {
    pub(crate) fn new(
        number: usize,
        master: &Master,
        clock: &Arc<Clock>,
        record: &Arc<Record>,
    ) -> Self {
        Self {
            number,
            way: Proxy::from(Ipv4Addr::new(127, 0, 2, 1 + number as u8), master.address),
            clock: clock.clone(),
            record: record.clone(),
            process: Mutex::new(None),
        }
    }

    pub(crate) fn start(&self) {
        let started = self.spawn();
        self.record
            .check("workers start", started.is_ok(), format!("{started:?}"));
    }

    fn spawn(&self) -> io::Result<()> {
        let mut process = lock(&self.process);
        if process.is_some() {
            // another fault was faster
            return Ok(());
        }
        let name = format!("worker {}", self.number);
        let mut command = Command::new(program("nestrad-worker"));
        command
            .args(["--master", &format!("http://{}", self.way.address)])
            .args(["--threads", "1", "--name", &name])
            .args(["--memory", &bounds::WORKER_GIB.to_string()])
            // it ends with this process
            .arg("--with-stdin")
            .env("RUST_LOG", "info")
            .env("NO_COLOR", "1")
            .env_remove("NESTRAD_TOKEN")
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        self.clock.set_up(&mut command);
        let mut child = command.spawn()?;
        if let Some(pipe) = child.stderr.take() {
            let saying = Saying::from_pipe(&name, &self.record, pipe);
            *process = Some((child, saying));
        }
        Ok(())
    }

    pub(crate) fn kill(&self) {
        if let Some((mut child, _)) = lock(&self.process).take() {
            kill(&mut child);
        }
    }

    /// Tells it to stop, as an orchestrator does.
    pub(crate) fn terminate(&self) {
        let Some((mut child, saying)) = lock(&self.process).take() else {
            return;
        };
        signal(child.id(), "TERM");
        let status = ends_within(&mut child, bounds::WORKER_STOPPED);
        let good = status.is_some_and(|status| status.success());
        let what = "a worker ends on SIGTERM with 0 within its time";
        let found = format!("{status:?}: {}", saying.last());
        self.record.check(what, good, found);
        kill(&mut child);
    }

    /// Does not run for a time.
    pub(crate) fn pause(&self, time: Duration) {
        let pid = lock(&self.process).as_ref().map(|(child, _)| child.id());
        let Some(pid) = pid else { return };
        signal(pid, "STOP");
        thread::sleep(time);
        signal(pid, "CONT");
    }

    /// What becomes of the reader of its log.
    pub(crate) fn set_reader(&self, reader: Reader) {
        if let Some((_, saying)) = &*lock(&self.process) {
            saying.set(reader);
        }
    }

    /// Starts it again where it has ended, which it must not do by itself.
    pub(crate) fn look_after(&self) {
        let mut process = lock(&self.process);
        let Some((child, saying)) = &mut *process else {
            return;
        };
        if let Ok(Some(status)) = child.try_wait() {
            let found = format!("worker {}: {status}: {}", self.number, saying.last());
            *process = None;
            drop(process);
            self.record
                .check("workers go on whatever happens", false, found);
            self.start();
        }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.kill();
    }
}
