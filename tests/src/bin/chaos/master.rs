//! The master: it is killed, stopped, and started again with the same state.

use std::fs::File;
use std::io;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use crate::bounds;
use crate::calls;
use crate::clock::Clock;
use crate::ground::Ground;
use crate::process::{Reader, Saying, ends_within, kill, lock, program, signal};
use crate::record::Record;
use crate::trouble::{Kind, Troubles};

/// Arguments of the master besides its address and its state.
fn arguments() -> [String; 24] {
    let of = |number: f64| number.to_string();
    [
        "--lease".into(),
        of(bounds::LEASE_S),
        "--patience".into(),
        of(bounds::PATIENCE_S),
        "--drain".into(),
        bounds::DRAIN_S.to_string(),
        "--solves".into(),
        bounds::SOLVES.to_string(),
        "--queue".into(),
        bounds::QUEUE.to_string(),
        "--memory".into(),
        of(bounds::SOLVE_GIB),
        "--scene-memory".into(),
        of(bounds::SCENE_GIB),
        "--result-memory".into(),
        of(bounds::RESULT_GIB),
        "--threads".into(),
        "2".into(),
        // else hardly any job would go to workers
        "--resident-memory".into(),
        "0".into(),
        // less than all scenes need: most jobs go to workers
        "--state-size".into(),
        "0.01".into(),
        // with fewer, a worker that lies in one job may be believed
        "--audit".into(),
        "1".into(),
    ]
}

/// The master of a run, whichever process it is now.
pub(crate) struct Master {
    pub(crate) address: SocketAddr,
    ground: Arc<Ground>,
    clock: Arc<Clock>,
    record: Arc<Record>,
    troubles: Arc<Troubles>,
    process: Mutex<Option<Process>>,
    is_stopped: AtomicBool,
}

struct Process {
    child: Child,
    saying: Arc<Saying>,
    /// Its log goes to a file on a small disk, not to a pipe.
    on_disk: bool,
}

impl Master {
    pub(crate) fn new(
        ground: &Arc<Ground>,
        clock: &Arc<Clock>,
        record: &Arc<Record>,
        troubles: &Arc<Troubles>,
    ) -> io::Result<Self> {
        // the port is free again, and hers for the whole run
        let address = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?;
        Ok(Self {
            address,
            ground: ground.clone(),
            clock: clock.clone(),
            record: record.clone(),
            troubles: troubles.clone(),
            process: Mutex::new(None),
            is_stopped: AtomicBool::new(false),
        })
    }

    /// Starts it, with its log on a disk or in a pipe, and waits until it serves.
    pub(crate) fn start(&self, on_disk: bool) {
        let on_disk = on_disk && self.ground.log.is_mounted;
        let mut process = lock(&self.process);
        match self.spawn(on_disk) {
            Ok(new) => *process = Some(new),
            Err(error) => self.record.check("the master starts", false, error),
        }
        drop(process);
        let begun = Instant::now();
        while begun.elapsed() < bounds::STARTED {
            if calls::status(self.address, Duration::from_secs(2)).is_ok() {
                self.record.check("the master starts", true, "");
                return;
            }
            if lock(&self.process).is_none() || self.is_stopped() {
                // another fault was faster
                return;
            }
            thread::sleep(Duration::from_millis(100));
        }
        let said = self.said();
        self.record.check("the master starts", false, said);
    }

    fn spawn(&self, on_disk: bool) -> io::Result<Process> {
        let mut command = Command::new(program("nestrad"));
        command
            .args(["serve", "--listen", &self.address.to_string(), "--state"])
            .arg(self.ground.state.path.join("state"))
            .args(arguments())
            .env("NESTRAD_LOG", "debug")
            .env_remove("NESTRAD_TOKEN")
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        self.clock.set_up(&mut command);
        let path = self.ground.log.path.join("master.log");
        if on_disk {
            let file = File::options().create(true).append(true).open(&path)?;
            command.stderr(file);
        } else {
            command.stderr(Stdio::piped());
        }
        let mut child = command.spawn()?;
        let saying = match child.stderr.take() {
            Some(pipe) => Saying::from_pipe("master", &self.record, pipe),
            None => Saying::from_file("master", &self.record, path),
        };
        Ok(Process {
            child,
            saying,
            on_disk,
        })
    }

    /// As a power failure would.
    pub(crate) fn kill(&self) {
        if let Some(mut process) = lock(&self.process).take() {
            kill(&mut process.child);
        }
    }

    /// Tells it to stop, as an upgrade does.
    pub(crate) fn terminate(&self) {
        let Some(mut process) = lock(&self.process).take() else {
            return;
        };
        signal(process.child.id(), "TERM");
        let begun = Instant::now();
        let mut status = ends_within(&mut process.child, bounds::STOPPED);
        // time in which it could not run does not count
        while status.is_none() && self.troubles.within(Kind::MasterPaused, begun) {
            if begun.elapsed() > 4 * bounds::STOPPED {
                break;
            }
            status = ends_within(&mut process.child, Duration::from_secs(1));
        }
        let good = status.is_some_and(|status| status.success());
        let found = || {
            let took = begun.elapsed();
            let said = process.saying.last();
            format!("{status:?} after {took:.1?}: {said}")
        };
        let what = "the master ends on SIGTERM with 0 within its time";
        self.record
            .check(what, good, if good { String::new() } else { found() });
        kill(&mut process.child);
    }

    /// Does not run for a time.
    pub(crate) fn pause(&self, time: Duration) {
        let Some(pid) = self.pid() else { return };
        self.is_stopped.store(true, Ordering::SeqCst);
        signal(pid, "STOP");
        thread::sleep(time);
        signal(pid, "CONT");
        self.is_stopped.store(false, Ordering::SeqCst);
    }

    pub(crate) fn is_stopped(&self) -> bool {
        self.is_stopped.load(Ordering::SeqCst)
    }

    /// What becomes of the reader of its log. Whether it has one.
    pub(crate) fn set_reader(&self, reader: Reader) -> bool {
        let process = lock(&self.process);
        let piped = process.as_ref().filter(|process| !process.on_disk);
        if let Some(process) = piped {
            process.saying.set(reader);
        }
        piped.is_some()
    }

    /// Whether its log goes to a disk now.
    pub(crate) fn logs_to_disk(&self) -> bool {
        let process = lock(&self.process);
        process.as_ref().is_some_and(|process| process.on_disk)
    }

    pub(crate) fn pid(&self) -> Option<u32> {
        lock(&self.process)
            .as_ref()
            .map(|process| process.child.id())
    }

    /// The last lines of its log.
    pub(crate) fn said(&self) -> String {
        let process = lock(&self.process);
        process.as_ref().map_or_else(
            || "(no process)".to_owned(),
            |process| process.saying.last(),
        )
    }

    /// Whether it has ended, though nobody wanted it to.
    pub(crate) fn ended(&self) -> Option<(ExitStatus, String)> {
        let mut process = lock(&self.process);
        let status = process.as_mut()?.child.try_wait().ok()??;
        let said = process.take()?.saying.last();
        Some((status, said))
    }
}

impl Drop for Master {
    fn drop(&mut self) {
        self.kill();
    }
}
