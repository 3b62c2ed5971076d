//! The log of a service: one line an event, on stderr.
//!
//! Who has something to say never waits for stderr, and never fails with it: lines are handed to a thread that writes
//! them. What cannot be written, because a disk is full, or a reader is gone or does not read, is dropped and counted.

use std::io::{self, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, Sender, SyncSender};
use std::thread;
use std::time::Duration;

use nestrad_common::{panics, printable};
use thiserror::Error;
use tracing_subscriber::EnvFilter;

/// Bytes of lines that wait to be written. Lines beyond are dropped.
const MOST_WAITING: usize = 8 << 20;

/// How long a process that ends waits for its last lines to be written.
const FAREWELL: Duration = Duration::from_secs(1);

/// Libraries that would write headers, and with them tokens, into the log.
const QUIET: [&str; 5] = [
    "h2=info",
    "hyper=info",
    "rustls=info",
    "tonic=info",
    "tower=info",
];

static DROPPED: AtomicU64 = AtomicU64::new(0);

/// Lines of the log that could not be written, since the process began.
pub fn dropped_lines() -> u64 {
    DROPPED.load(Ordering::Relaxed)
}

/// The log of this process. What was said before this goes is written, if it can be.
#[derive(Debug)]
pub struct Log {
    lines: Lines,
}

/// Why there is no log.
#[derive(Debug, Error)]
pub enum LogError {
    /// There is no thread to write it.
    #[error("cannot start threads")]
    Thread(#[source] io::Error),
    /// There is one already.
    #[error("there is a log already")]
    Twice,
}

impl Log {
    /// Begins the log of this process; the environment `variable` says how much is told. Panics are told in it too.
    pub fn begin(variable: &str) -> Result<Self, LogError> {
        let mut filter =
            EnvFilter::try_from_env(variable).unwrap_or_else(|_| EnvFilter::new("info"));
        for quiet in QUIET.iter().filter_map(|directive| directive.parse().ok()) {
            filter = filter.add_directive(quiet);
        }
        let lines = Lines::to(io::stderr()).map_err(LogError::Thread)?;
        let writer = lines.clone();
        tracing_subscriber::fmt()
            .with_env_filter(filter)
            .with_writer(move || writer.clone())
            // it would say so on stderr, and panic where that fails
            .log_internal_errors(false)
            .with_ansi(false)
            .try_init()
            .map_err(|_| LogError::Twice)?;
        panics::tell(|panic| tracing::error!("{panic}"));
        Ok(Self { lines })
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        self.lines.end(FAREWELL);
    }
}

enum Said {
    Line(Vec<u8>),
    /// Everything before this is written when it is answered.
    End(SyncSender<()>),
}

/// Lines on their way to be written; clones lead to the same place.
#[derive(Clone, Debug)]
struct Lines {
    said: Sender<Said>,
    /// Bytes that wait.
    waiting: Arc<AtomicUsize>,
}

impl Lines {
    fn to(mut out: impl Write + Send + 'static) -> io::Result<Self> {
        let (said, lines) = mpsc::channel();
        let waiting = Arc::new(AtomicUsize::new(0));
        let counted = waiting.clone();
        thread::Builder::new()
            .name("log".to_owned())
            .spawn(move || write(&lines, &counted, &mut out))?;
        Ok(Self { said, waiting })
    }

    fn end(&self, patience: Duration) {
        let (written, answer) = mpsc::sync_channel(1);
        if self.said.send(Said::End(written)).is_ok() {
            // a stderr that takes nothing holds up no process
            let _ = answer.recv_timeout(patience);
        }
    }
}

fn write(said: &Receiver<Said>, waiting: &AtomicUsize, out: &mut impl Write) {
    for said in said {
        match said {
            Said::Line(line) => {
                if out.write_all(&line).and_then(|()| out.flush()).is_err() {
                    DROPPED.fetch_add(1, Ordering::Relaxed);
                }
                waiting.fetch_sub(line.len(), Ordering::Relaxed);
            }
            Said::End(written) => {
                // nobody waits any more
                let _ = written.try_send(());
            }
        }
    }
}

/// Takes an event, which is always taken, as one line.
impl Write for Lines {
    fn write(&mut self, event: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(event);
        let mut line = printable::line(text.trim_end_matches('\n'))
            .into_owned()
            .into_bytes();
        line.push(b'\n');
        let bytes = line.len();
        let before = self.waiting.fetch_add(bytes, Ordering::Relaxed);
        if before + bytes > MOST_WAITING || self.said.send(Said::Line(line)).is_err() {
            self.waiting.fetch_sub(bytes, Ordering::Relaxed);
            DROPPED.fetch_add(1, Ordering::Relaxed);
        }
        Ok(event.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    /// Keeps what is written, or fails.
    #[derive(Clone, Default)]
    struct Disk {
        written: Arc<Mutex<Vec<u8>>>,
        full: bool,
    }

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.full {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.written.lock().unwrap().extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn an_event_is_one_line_whatever_is_in_it() {
        let disk = Disk::default();
        let mut lines = Lines::to(disk.clone()).unwrap();
        lines
            .write_all(b"joins \x1b[2J\n2026 INFO forged\n")
            .unwrap();
        lines.end(FAREWELL);
        let written = String::from_utf8(disk.written.lock().unwrap().clone()).unwrap();
        assert_eq!(written, "joins \\u{1b}[2J\\n2026 INFO forged\n");
    }

    #[test]
    fn what_cannot_be_written_is_dropped_and_counted_and_nobody_waits() {
        let before = dropped_lines();
        let full = Disk {
            full: true,
            ..Disk::default()
        };
        let mut lines = Lines::to(full).unwrap();
        lines.write_all(b"lost\n").unwrap();
        lines.end(FAREWELL);
        assert!(dropped_lines() > before);

        // a reader that does not read: its pipe takes a few kibibytes, and then nothing
        let (_reader, pipe) = io::pipe().unwrap();
        let mut lines = Lines::to(pipe).unwrap();
        let before = dropped_lines();
        for _ in 0..20 {
            lines.write_all(&[b'x'; 1 << 20]).unwrap();
        }
        assert!(dropped_lines() >= before + 10);
        lines.end(Duration::from_millis(10));
    }
}
