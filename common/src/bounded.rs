//! Whole files of bounded size: the only way in which the programs read a file that somebody names. Nothing is read of
//! a file that is too large, and what has no size (a pipe) is read no further than the limit, and not for ever.

use std::borrow::Cow;
use std::fmt;
use std::fs::{self, File, FileType};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

/// The most bytes that are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limit {
    /// So many.
    pub bytes: u64,
    /// What the limit comes from, for messages; may be empty.
    pub of: &'static str,
    /// Text has a line end within so many bytes.
    pub line_bytes: Option<usize>,
}

impl Limit {
    /// A limit that is the same for all files of its kind.
    pub const fn fixed(bytes: u64) -> Self {
        Self {
            bytes,
            of: "",
            line_bytes: None,
        }
    }

    /// The same for text with lines no longer than that.
    #[must_use]
    pub const fn of_lines(self, bytes: usize) -> Self {
        Self {
            line_bytes: Some(bytes),
            ..self
        }
    }

    pub(crate) fn exceeded(self, what: &str) -> io::Error {
        io::Error::new(
            ErrorKind::FileTooLarge,
            format!("{what} is larger than {self}"),
        )
    }

    /// Refuses what begins like no text.
    fn check(self, bytes: &[u8]) -> io::Result<()> {
        let Some(longest) = self.line_bytes else {
            return Ok(());
        };
        // what is compressed has no lines yet
        let begin = &bytes[..bytes.len().min(longest + 1)];
        let has_line = begin.iter().any(|byte| matches!(byte, b'\n' | b'\r'));
        if begin.len() <= longest || has_line || begin.starts_with(GZIP) {
            return Ok(());
        }
        let size = Self::fixed(longest as u64);
        let message = format!("its first line is longer than {size}");
        Err(io::Error::new(ErrorKind::InvalidData, message))
    }
}

/// How a gzip file begins.
pub(crate) const GZIP: &[u8] = &[0x1f, 0x8b];

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bytes {
            bytes if bytes >= 1 << 30 => {
                write!(f, "{:.3} GiB", bytes as f64 / f64::from(1 << 30))?;
            }
            bytes if bytes >= 1 << 20 => {
                write!(f, "{:.3} MiB", bytes as f64 / f64::from(1 << 20))?;
            }
            bytes => write!(f, "{bytes} bytes")?,
        }
        if self.of.is_empty() {
            return Ok(());
        }
        write!(f, " ({})", self.of)
    }
}

/// A pipe that brings less than [`SOMETHING`] in this time, and does not end, is given up.
const SILENCE: Duration = Duration::from_secs(60);

/// Bytes; less is nothing.
const SOMETHING: usize = 4096;

/// Bytes that are read at a time.
const STEP: usize = 1 << 20;

/// Opens a file that is read part by part: not a pipe, not a device.
pub fn open(path: &Path) -> io::Result<File> {
    if !facts(path)?.is_file() {
        let message = "expected a file, found a pipe";
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    File::open(path)
}

/// What is known of a file or a pipe, asked before it is opened: to open a pipe may take for ever.
fn facts(path: &Path) -> io::Result<fs::Metadata> {
    let facts = fs::metadata(path)?;
    let kind = facts.file_type();
    if kind.is_dir() {
        return Err(ErrorKind::IsADirectory.into());
    }
    if is_device(kind) {
        let message = "expected a file or a pipe, found a device";
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    Ok(facts)
}

/// The whole content of a file.
pub fn read(path: &Path, limit: Limit) -> io::Result<Vec<u8>> {
    let facts = facts(path)?;
    let kind = facts.file_type();
    if facts.len() > limit.bytes {
        return Err(limit.exceeded("the file"));
    }
    // what the system makes up while it is read (/proc) has no size either
    if !kind.is_file() || facts.len() == 0 {
        return read_pipe(path, limit, SILENCE);
    }
    let mut bytes = Vec::new();
    let expected = usize::try_from(facts.len() + 1).unwrap_or(usize::MAX);
    bytes
        .try_reserve_exact(expected)
        .map_err(|_| io::Error::from(ErrorKind::OutOfMemory))?;
    let mut file = File::open(path)?;
    for step in [STEP as u64 + 1, limit.bytes.saturating_add(1)] {
        let more = step.min(limit.bytes.saturating_add(1)) - bytes.len() as u64;
        file.by_ref().take(more).read_to_end(&mut bytes)?;
        limit.check(&bytes)?;
    }
    if bytes.len() as u64 > limit.bytes {
        return Err(limit.exceeded("the file"));
    }
    Ok(bytes)
}

/// Text whose lines end with a line feed, whatever system wrote it.
pub fn with_line_feeds(bytes: &[u8]) -> Cow<'_, [u8]> {
    let lone = |at: &usize| bytes[*at] == b'\r' && bytes.get(at + 1) != Some(&b'\n');
    if !(0..bytes.len()).any(|at| lone(&at)) {
        return bytes.into();
    }
    let mut ended = bytes.to_vec();
    for at in (0..bytes.len()).filter(lone) {
        ended[at] = b'\n';
    }
    ended.into()
}

#[cfg(unix)]
fn is_device(kind: FileType) -> bool {
    use std::os::unix::fs::FileTypeExt;
    kind.is_char_device() || kind.is_block_device()
}

#[cfg(not(unix))]
fn is_device(_: FileType) -> bool {
    false
}

/// What comes out of a pipe. Read by a thread of its own: where nothing comes, it is left behind.
fn read_pipe(path: &Path, limit: Limit, silence: Duration) -> io::Result<Vec<u8>> {
    let (sender, receiver) = mpsc::sync_channel(1);
    let path = path.to_owned();
    thread::Builder::new().spawn(move || {
        let failed = pump(path, |part| sender.send(Ok(part)).is_ok()).err();
        // nobody may listen any more
        let _ = failed.map(|error| sender.send(Err(error)));
    })?;
    let mut bytes = Vec::new();
    let (mut since, mut counted) = (Instant::now(), 0);
    loop {
        let part = match receiver.recv_timeout(silence.saturating_sub(since.elapsed())) {
            Ok(part) => part?,
            Err(RecvTimeoutError::Disconnected) => return Ok(bytes),
            Err(RecvTimeoutError::Timeout) => {
                let message = format!(
                    "a pipe that brings less than {SOMETHING} bytes in {} s and does not end",
                    silence.as_secs_f64()
                );
                return Err(io::Error::new(ErrorKind::TimedOut, message));
            }
        };
        if (bytes.len() + part.len()) as u64 > limit.bytes {
            return Err(limit.exceeded("what comes out of the pipe"));
        }
        bytes.extend_from_slice(&part);
        limit.check(&bytes)?;
        if bytes.len() - counted >= SOMETHING {
            (since, counted) = (Instant::now(), bytes.len());
        }
    }
}

/// Hands over a file in parts, as long as they are wanted.
fn pump(path: PathBuf, mut wanted: impl FnMut(Vec<u8>) -> bool) -> io::Result<()> {
    let mut file = File::open(path)?;
    loop {
        let mut part = vec![0; STEP];
        let count = match file.read(&mut part) {
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            count => count?,
        };
        part.truncate(count);
        if count == 0 || !wanted(part) {
            return Ok(());
        }
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use std::io::Write;
    use std::process::Command;

    use super::*;

    fn refusal(path: &Path, limit: Limit) -> String {
        read(path, limit).unwrap_err().to_string()
    }

    fn pipe(folder: &Path) -> PathBuf {
        let path = folder.join("pipe");
        let made = Command::new("mkfifo").arg(&path).status();
        assert!(made.unwrap().success());
        path
    }

    #[test]
    fn a_file_is_read_up_to_its_limit_and_not_further() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        for (length, limit) in [(0, 0), (100, 100), (3 << 20, 3 << 20)] {
            fs::write(&path, vec![b'x'; length]).unwrap();
            assert_eq!(read(&path, Limit::fixed(limit)).unwrap().len(), length);
        }
        let limit = Limit {
            of: "half of --memory",
            ..Limit::fixed((3 << 20) - 1)
        };
        let expected = "the file is larger than 3.000 MiB (half of --memory)";
        assert_eq!(refusal(&path, limit), expected);
        let text = read(Path::new("/proc/self/status"), Limit::fixed(1 << 20)).unwrap();
        assert!(text.starts_with(b"Name:"));
    }

    #[test]
    fn a_file_of_a_terabyte_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sparse");
        File::create(&path).unwrap().set_len(1 << 40).unwrap();
        let begun = Instant::now();
        let expected = "the file is larger than 8.000 GiB";
        assert_eq!(refusal(&path, Limit::fixed(8 << 30)), expected);
        // and one that would fit is no text
        File::create(&path).unwrap().set_len(1 << 32).unwrap();
        let limit = Limit::fixed(8 << 30).of_lines(1 << 20);
        let expected = "its first line is longer than 1.000 MiB";
        assert_eq!(refusal(&path, limit), expected);
        assert!(begun.elapsed() < Duration::from_secs(5));
    }

    #[test]
    fn devices_have_no_end() {
        for device in ["/dev/zero", "/dev/null", "/dev/urandom"] {
            let found = refusal(Path::new(device), Limit::fixed(1 << 40));
            assert_eq!(found, "expected a file or a pipe, found a device");
            assert!(open(Path::new(device)).is_err());
        }
    }

    #[test]
    fn a_pipe_is_read_to_its_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = pipe(folder.path());
        assert!(open(&path).is_err());
        let (into, bytes) = (path.clone(), vec![b'x'; 3 << 20]);
        let writer = thread::spawn(move || fs::write(into, bytes).unwrap());
        assert_eq!(read(&path, Limit::fixed(8 << 20)).unwrap().len(), 3 << 20);
        writer.join().unwrap();
    }

    #[test]
    fn a_pipe_that_never_ends_is_given_up() {
        let folder = tempfile::tempdir().unwrap();
        let path = pipe(folder.path());
        let into = path.clone();
        // zeros for ever, until the reader goes
        let writer = thread::spawn(move || {
            let mut pipe = File::options().write(true).open(into).unwrap();
            while pipe.write_all(&[0; 1 << 16]).is_ok() {}
        });
        let expected = "what comes out of the pipe is larger than 8.000 MiB";
        assert_eq!(refusal(&path, Limit::fixed(8 << 20)), expected);
        writer.join().unwrap();
    }

    #[test]
    fn a_silent_pipe_is_given_up() {
        let folder = tempfile::tempdir().unwrap();
        let path = pipe(folder.path());
        let silence = Duration::from_millis(50);
        let limit = Limit::fixed(1 << 20);
        let error = read_pipe(&path, limit, silence).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::TimedOut);
        assert!(error.to_string().contains("in 0.05 s"), "{error}");
        // also where somebody writes a little, again and again
        let mut pipe = File::options().read(true).write(true).open(&path).unwrap();
        let (stop, stopped) = mpsc::channel::<()>();
        let drip = thread::spawn(move || {
            while stopped.recv_timeout(silence / 10) == Err(RecvTimeoutError::Timeout) {
                pipe.write_all(b"x").unwrap();
            }
        });
        assert!(read_pipe(&path, limit, silence).is_err());
        drop(stop);
        drip.join().unwrap();
    }
}
