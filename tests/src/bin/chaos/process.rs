//! A program that runs, and what it says.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::record::Record;

/// Whoever reads what a program says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Reader {
    Listens,
    /// Has not gone, and reads nothing.
    Sleeps,
    Gone,
}

/// Lines of what was said that are remembered.
const REMEMBERED: usize = 40;

/// What a program says on stderr, as it is read.
pub(crate) struct Saying {
    name: String,
    record: Arc<Record>,
    reader: Mutex<Reader>,
    last: Mutex<VecDeque<String>>,
}

impl Saying {
    fn new(name: &str, record: &Arc<Record>) -> Arc<Self> {
        Arc::new(Self {
            name: name.to_owned(),
            record: record.clone(),
            reader: Mutex::new(Reader::Listens),
            last: Mutex::default(),
        })
    }

    /// Reads a pipe.
    pub(crate) fn from_pipe(
        name: &str,
        record: &Arc<Record>,
        stderr: impl Read + Send + 'static,
    ) -> Arc<Self> {
        let saying = Self::new(name, record);
        let kept = saying.clone();
        thread::spawn(move || {
            let mut lines = BufReader::new(stderr).split(b'\n').map_while(Result::ok);
            loop {
                let reader = *lock(&kept.reader);
                match reader {
                    Reader::Listens => {}
                    Reader::Sleeps => {
                        thread::sleep(Duration::from_millis(50));
                        continue;
                    }
                    // with this the pipe is closed
                    Reader::Gone => return,
                }
                let Some(line) = lines.next() else { return };
                kept.hear(&String::from_utf8_lossy(&line));
            }
        });
        saying
    }

    /// Reads a file on a small disk, from which it takes what it has read.
    pub(crate) fn from_file(name: &str, record: &Arc<Record>, path: PathBuf) -> Arc<Self> {
        let saying = Self::new(name, record);
        let kept = Arc::downgrade(&saying);
        thread::spawn(move || {
            while let Some(saying) = kept.upgrade() {
                let text = fs::read(&path).unwrap_or_default();
                if let Ok(file) = File::options().write(true).open(&path) {
                    // lines that came between the two are lost
                    let _ = file.set_len(0);
                }
                String::from_utf8_lossy(&text)
                    .lines()
                    .for_each(|line| saying.hear(line));
                drop(saying);
                thread::sleep(Duration::from_secs(1));
            }
        });
        saying
    }

    fn hear(&self, line: &str) {
        if line.contains("panicked at") {
            self.record
                .check("no program panics", false, format!("{}: {line}", self.name));
        }
        let mut last = lock(&self.last);
        if last.len() == REMEMBERED {
            last.pop_front();
        }
        last.push_back(line.to_owned());
    }

    pub(crate) fn set(&self, reader: Reader) {
        *lock(&self.reader) = reader;
    }

    /// The last lines.
    pub(crate) fn last(&self) -> String {
        let last = lock(&self.last);
        last.iter().map(|line| format!("{line}\n")).collect()
    }
}

/// Sends a signal to a process, which may have ended.
pub(crate) fn signal(pid: u32, name: &str) {
    let kill = ["-s", name, &pid.to_string()];
    let _ = Command::new("kill").args(kill).output();
}

/// Waits for the end of a process, but no longer than this.
pub(crate) fn ends_within(child: &mut Child, patience: Duration) -> Option<ExitStatus> {
    let until = Instant::now() + patience;
    loop {
        if let Ok(Some(status)) = child.try_wait() {
            return Some(status);
        }
        if Instant::now() > until {
            return None;
        }
        thread::sleep(Duration::from_millis(20));
    }
}

/// As it ends when nobody else ends it.
pub(crate) fn kill(child: &mut Child) {
    // it may have ended already
    let _ = child.kill();
    let _ = child.wait();
}

/// The program that was built beside this one.
pub(crate) fn program(name: &str) -> PathBuf {
    std::env::current_exe().map_or_else(|_| name.into(), |path| path.with_file_name(name))
}

/// Behind these locks everything is whole at any time, even if a thread died with one.
pub(crate) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
