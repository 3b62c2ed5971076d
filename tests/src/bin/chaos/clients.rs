//! The clients: each solves one scene after the other through a way of its own, and is judged.

use std::fs;
use std::io;
use std::net::Ipv4Addr;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use nestrad_tests::proxy::Proxy;
use nestrad_tests::random::Dice;

use crate::bounds;
use crate::ground::Ground;
use crate::master::Master;
use crate::process::{kill, lock, program, signal};
use crate::record::Record;
use crate::scenes::Case;
use crate::trouble::Troubles;
use crate::verdict::{Deeds, End, Solved};

/// A client, whichever process it is now.
pub(crate) struct Client {
    pub(crate) number: usize,
    pub(crate) way: Proxy,
    ground: Arc<Ground>,
    record: Arc<Record>,
    troubles: Arc<Troubles>,
    cases: Arc<Vec<Case>>,
    now: Mutex<Now>,
    last_end: Arc<Mutex<Instant>>,
}

/// What the next process begins with, and what is done to this one.
#[derive(Default)]
struct Now {
    pid: Option<u32>,
    deeds: Deeds,
    paused: Duration,
    next_on_full_disk: bool,
    next_unheard: bool,
}

impl Client {
    pub(crate) fn new(
        number: usize,
        master: &Master,
        ground: &Arc<Ground>,
        record: &Arc<Record>,
        troubles: &Arc<Troubles>,
        cases: &Arc<Vec<Case>>,
        last_end: &Arc<Mutex<Instant>>,
    ) -> Self {
        Self {
            number,
            // each is a machine of its own to the master
            way: Proxy::from(Ipv4Addr::new(127, 0, 1, 1 + number as u8), master.address),
            ground: ground.clone(),
            record: record.clone(),
            troubles: troubles.clone(),
            cases: cases.clone(),
            now: Mutex::default(),
            last_end: last_end.clone(),
        }
    }

    /// Solves until it is told to stop.
    pub(crate) fn run(&self, seed: u64, stop: &AtomicBool) {
        let mut dice = Dice(seed ^ (self.number as u64 + 1) << 32);
        let mut turn = 0;
        while !stop.load(Ordering::SeqCst) {
            let case = &self.cases[dice.below(self.cases.len())];
            self.solve(case, turn);
            turn += 1;
        }
    }

    /// One solve; how it ended.
    pub(crate) fn solve(&self, case: &Case, turn: u64) -> Option<End> {
        let begun = Instant::now();
        let ended = self.ended(case, turn);
        let took = begun.elapsed();
        *lock(&self.last_end) = Instant::now();
        match ended {
            Ok(solved) => {
                let end = solved.judge(case, &self.troubles);
                let (number, name) = (self.number, case.name);
                let text = format!("{number}, {name}: {end} after {took:.1?}");
                self.record.client(&end.kind(), took, text);
                for (what, holds) in end.checks() {
                    let found = format!("client {number}, {name}: {end}: {}", solved.essence());
                    self.record.check(what, holds, found);
                }
                Some(end)
            }
            Err(error) => {
                self.record.check("clients start", false, error);
                thread::sleep(Duration::from_secs(1));
                None
            }
        }
    }

    fn ended(&self, case: &Case, turn: u64) -> io::Result<Solved> {
        let mut now = lock(&self.now);
        let (full, unheard) = (now.next_on_full_disk, now.next_unheard);
        *now = Now::default();
        now.deeds.full_disk = full;
        now.deeds.unheard = unheard;
        let folder = if full {
            self.ground.out.path.clone()
        } else {
            self.ground.folder().to_owned()
        };
        let out = folder.join(format!("out-{}-{turn}", self.number));
        let mut child = Command::new(program("nestrad"))
            .args(&case.arguments)
            .arg("--out")
            .arg(&out)
            .args(["--master", &format!("http://{}", self.way.address)])
            .current_dir(self.ground.folder())
            .env_remove("NESTRAD_TOKEN")
            .env_remove("RUST_BACKTRACE")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()?;
        now.pid = Some(child.id());
        drop(now);
        if unheard {
            drop((child.stdout.take(), child.stderr.take()));
        }
        let begun = Instant::now();
        // what it says is less than a pipe holds
        let status = loop {
            if let Some(status) = child.try_wait()? {
                break Some(status);
            }
            if begun.elapsed() > bounds::CLIENT + lock(&self.now).paused {
                break None;
            }
            thread::sleep(Duration::from_millis(20));
        };
        // what is meant for the next one stays
        let deeds = {
            let mut now = lock(&self.now);
            now.pid = None;
            now.deeds
        };
        kill(&mut child);
        let output = child.wait_with_output()?;
        let solved = Solved {
            client: self.number,
            begun,
            status,
            said: String::from_utf8_lossy(&output.stderr).into_owned(),
            out,
            deeds,
        };
        Ok(solved)
    }

    pub(crate) fn kill(&self) {
        self.does("KILL", |deeds| deeds.killed = true);
    }

    /// As Ctrl-C does.
    pub(crate) fn interrupt(&self) {
        self.does("INT", |deeds| deeds.interrupted = true);
    }

    fn does(&self, name: &str, deed: impl FnOnce(&mut Deeds)) {
        let mut now = lock(&self.now);
        if let Some(pid) = now.pid {
            deed(&mut now.deeds);
            signal(pid, name);
        }
    }

    /// Does not run for a time.
    pub(crate) fn pause(&self, time: Duration) {
        let mut now = lock(&self.now);
        let Some(pid) = now.pid else { return };
        now.deeds.paused = true;
        now.paused += time;
        signal(pid, "STOP");
        drop(now);
        thread::sleep(time);
        signal(pid, "CONT");
    }

    /// The next process writes to a disk that is full.
    pub(crate) fn write_to_full_disk(&self) {
        lock(&self.now).next_on_full_disk = true;
    }

    /// Nobody reads what the next process says.
    pub(crate) fn unheard(&self) {
        lock(&self.now).next_unheard = true;
    }
}

impl Solved {
    /// What is not needed any more.
    pub(crate) fn clear(&self) {
        // it may not have been made
        let _ = fs::remove_dir_all(&self.out);
    }
}
