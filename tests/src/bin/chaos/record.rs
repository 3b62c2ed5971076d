//! The log of a run: one line an event, and at the end what there was of each kind.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What has been seen so far.
pub(crate) struct Record {
    begun: Instant,
    seen: Mutex<Seen>,
}

struct Seen {
    file: File,
    faults: BTreeMap<String, u64>,
    skipped: BTreeMap<String, u64>,
    ends: BTreeMap<String, u64>,
    checks: BTreeMap<&'static str, Check>,
    peak_memory_bytes: u64,
    peak_files: u64,
    longest_client: Duration,
}

/// How often something that must hold did.
#[derive(Clone, Copy, Default)]
struct Check {
    passed: u64,
    failed: u64,
}

impl Record {
    pub(crate) fn create(path: &Path) -> io::Result<Self> {
        let seen = Seen {
            file: File::create(path)?,
            faults: BTreeMap::new(),
            skipped: BTreeMap::new(),
            ends: BTreeMap::new(),
            checks: BTreeMap::new(),
            peak_memory_bytes: 0,
            peak_files: 0,
            longest_client: Duration::ZERO,
        };
        Ok(Self {
            begun: Instant::now(),
            seen: Mutex::new(seen),
        })
    }

    /// Something that happened.
    pub(crate) fn event(&self, what: &str, text: impl Display) {
        self.line(&mut self.lock(), what, &text.to_string());
    }

    /// A fault that begins.
    pub(crate) fn fault(&self, name: &str, text: impl Display) {
        let mut seen = self.lock();
        *seen.faults.entry(name.to_owned()).or_default() += 1;
        self.line(&mut seen, "fault", &format!("{name}: {text}"));
    }

    /// A fault that could not be made here.
    pub(crate) fn skipped(&self, name: &str, why: impl Display) {
        let mut seen = self.lock();
        *seen.skipped.entry(name.to_owned()).or_default() += 1;
        self.line(&mut seen, "skipped", &format!("{name}: {why}"));
    }

    /// A client that has ended.
    pub(crate) fn client(&self, end: &str, took: Duration, text: impl Display) {
        let mut seen = self.lock();
        *seen.ends.entry(end.to_owned()).or_default() += 1;
        seen.longest_client = seen.longest_client.max(took);
        self.line(&mut seen, "client", &text.to_string());
    }

    /// Something that must hold; `found` says what is there where it does not.
    pub(crate) fn check(&self, what: &'static str, holds: bool, found: impl Display) {
        let mut seen = self.lock();
        let check = seen.checks.entry(what).or_default();
        if holds {
            check.passed += 1;
        } else {
            check.failed += 1;
            self.line(&mut seen, "FAILED", &format!("{what}: {found}"));
        }
    }

    /// What the master takes now.
    pub(crate) fn taken(&self, memory_bytes: u64, files: u64) {
        let mut seen = self.lock();
        seen.peak_memory_bytes = seen.peak_memory_bytes.max(memory_bytes);
        seen.peak_files = seen.peak_files.max(files);
    }

    /// Writes what there was of everything; whether all that must hold did.
    pub(crate) fn close(&self) -> bool {
        let mut seen = self.lock();
        let mut lines = Vec::new();
        for (title, counts) in [
            ("fault", &seen.faults),
            ("skipped", &seen.skipped),
            ("clients", &seen.ends),
        ] {
            lines.extend(counts.iter().map(|(k, n)| format!("{n:6} {title}: {k}")));
        }
        lines.push(format!(
            "longest client {:.1} s; peak of the master {:.1} MiB, {} open files",
            seen.longest_client.as_secs_f64(),
            seen.peak_memory_bytes as f64 / (1 << 20) as f64,
            seen.peak_files
        ));
        let (mut passed, mut failed) = (0, 0);
        for (what, check) in &seen.checks {
            let Check {
                passed: good,
                failed: bad,
            } = *check;
            lines.push(format!("{good:6} passed, {bad} failed: {what}"));
            passed += good;
            failed += bad;
        }
        lines.push(format!("{passed} passed, {failed} failed"));
        for line in lines {
            self.line(&mut seen, "summary", &line);
        }
        failed == 0
    }

    fn line(&self, seen: &mut Seen, what: &str, text: &str) {
        let at = self.begun.elapsed().as_secs_f64();
        // what processes say may have several lines
        let text = text.trim().replace('\n', " | ");
        let line = format!("{at:9.2} s  {what:8} {text}\n");
        // a log that cannot be written shows on the terminal
        if seen.file.write_all(line.as_bytes()).is_err() || matches!(what, "FAILED" | "summary") {
            eprint!("{line}");
        }
    }

    fn lock(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
