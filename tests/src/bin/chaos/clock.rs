//! Clocks that are set: libfaketime of Debian moves the time of day of the programs, not the time that passes.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where Debian has it.
const LIBRARY: &str = "/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1";

/// The time of day of the master and the workers.
pub(crate) struct Clock {
    file: PathBuf,
    pub(crate) is_there: bool,
}

impl Clock {
    pub(crate) fn new(file: PathBuf) -> io::Result<Self> {
        let clock = Self {
            file,
            is_there: Path::new(LIBRARY).exists(),
        };
        clock.set(0)?;
        Ok(clock)
    }

    /// Puts the clock so many seconds beside the true time.
    pub(crate) fn set(&self, seconds: i64) -> io::Result<()> {
        // programs never find half a file
        let beside = self.file.with_extension("new");
        fs::write(&beside, format!("{seconds:+}"))?;
        fs::rename(beside, &self.file)
    }

    /// Has a program go by this clock.
    pub(crate) fn set_up(&self, command: &mut Command) {
        if self.is_there {
            command
                .env("LD_PRELOAD", LIBRARY)
                .env("FAKETIME_TIMESTAMP_FILE", &self.file)
                .env("FAKETIME_CACHE_DURATION", "1")
                .env("FAKETIME_DONT_FAKE_MONOTONIC", "1");
        }
    }
}
