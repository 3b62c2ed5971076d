//! Results of near-field jobs, kept on disk from one solve to the next.
//!
//! A result is named by what it is made from: the block's geometry, the job's lines and rays, and the
//! kernel. Results are written behind the solve's back, and each carries a checksum: what cannot be
//! written is not kept, what cannot be read is computed anew, and neither fails a solve.

mod file;

use std::collections::BTreeSet;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use nestrad_common::panics;
use nestrad_engine::exchange::Origin;
use nestrad_kernel::PackedRows;
use thiserror::Error;

use file::{File, FileError};

/// Names the result of a job by its content.
pub type Key = [u8; 32];

/// Results that wait to be written: more, and who brings them waits.
const WAITING: usize = 256;

/// A store in a folder; clones are the same store. What is waiting is written before the last one goes.
#[derive(Clone)]
pub struct Store(Arc<Shared>);

impl fmt::Debug for Store {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Store")
            .field("bytes", &self.bytes())
            .finish()
    }
}

/// What is to be written.
enum Written {
    /// A result, and who computed it, where it was a worker.
    Result(Key, Arc<PackedRows>, Option<Origin>),
    /// The result of that name was computed again, and is right.
    Audited(Key),
    /// No result of that worker is to be kept.
    Without(Arc<str>),
}

struct Shared {
    file: Arc<Mutex<Option<File>>>,
    /// `None` once nothing can be written any more.
    waiting: Mutex<Option<SyncSender<Written>>>,
    writer: Mutex<Option<JoinHandle<()>>>,
    /// What went wrong, for whoever asks.
    warning: Arc<Mutex<Option<String>>>,
    closed: AtomicBool,
    /// Workers whose results are not given out.
    distrusted: Mutex<BTreeSet<Arc<str>>>,
}

/// Why a store cannot be used.
#[derive(Debug, Error)]
pub enum StoreError {
    /// The folder cannot be made.
    #[error("{}: cannot be made", folder.display())]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// What is named is something else than a folder.
    #[error("{}: expected a folder, found a file", folder.display())]
    NoFolder {
        /// What was named.
        folder: PathBuf,
    },
    /// Another master has it.
    #[error("{}: is in use by another nestrad", file.display())]
    InUse {
        /// The file.
        file: PathBuf,
    },
    /// It cannot be read or written.
    #[error("{}: {reason}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// There is no thread to write with.
    #[error("cannot start threads")]
    Thread(#[source] io::Error),
}

impl Store {
    /// Opens the store in a folder, which is made if there is none. It holds at most so many bytes of
    /// results; the oldest go first. A file that is broken is put aside; one that is whole, on a disk that is full or
    /// takes nothing, stays.
    pub fn open(folder: &Path, most_bytes: u64) -> Result<Self, StoreError> {
        fs::create_dir_all(folder).map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists | io::ErrorKind::NotADirectory => StoreError::NoFolder {
                folder: folder.to_owned(),
            },
            _ => StoreError::Folder {
                folder: folder.to_owned(),
                source,
            },
        })?;
        let path = folder.join("results.redb");
        let refused = |error: FileError| match error {
            FileError::InUse => StoreError::InUse { file: path.clone() },
            FileError::Disk(reason) | FileError::Broken(reason) => StoreError::File {
                file: path.clone(),
                reason,
            },
        };
        let mut warned = None;
        let file = match File::open(&path, most_bytes) {
            Err(FileError::Broken(reason)) => {
                let aside = path.with_extension("corrupt");
                warned = Some(format!(
                    "{}: {reason}; the file is renamed to {}",
                    path.display(),
                    aside.display()
                ));
                fs::rename(&path, &aside).map_err(|e| StoreError::File {
                    file: path.clone(),
                    reason: format!("{reason}; it cannot be renamed: {e}"),
                })?;
                File::open(&path, most_bytes)
            }
            opened => opened,
        };
        let file = Arc::new(Mutex::new(Some(file.map_err(refused)?)));
        let warning = Arc::new(Mutex::new(warned));
        let (sender, receiver) = mpsc::sync_channel(WAITING);
        let (shared, told) = (file.clone(), warning.clone());
        let writer = thread::Builder::new()
            .name("store".to_owned())
            .spawn(move || {
                let written = panics::caught(|| write(&receiver, &shared, &told));
                if let Err(panic) = written {
                    tell(
                        &told,
                        &format!("results are no longer kept: internal fault: {panic}"),
                    );
                }
            })
            .map_err(StoreError::Thread)?;
        Ok(Self(Arc::new(Shared {
            file,
            waiting: Mutex::new(Some(sender)),
            writer: Mutex::new(Some(writer)),
            warning,
            closed: AtomicBool::new(false),
            distrusted: Mutex::default(),
        })))
    }

    /// The result of that name, if it is kept and whole; whether it fits its job is for the caller to check.
    pub fn get(&self, key: &Key) -> Option<PackedRows> {
        let mut file = lock(&self.0.file);
        let file_open = file.as_mut()?;
        let distrusted = lock(&self.0.distrusted);
        let is_trusted = |origin: Option<Origin>| {
            origin.is_none_or(|origin| !distrusted.contains(&origin.worker))
        };
        let read = if distrusted.is_empty() {
            file_open.get(key)
        } else {
            let origin = file_open.origin(key);
            origin.and_then(|origin| match is_trusted(origin) {
                true => file_open.get(key),
                false => Ok(None),
            })
        };
        match read {
            Ok(found) => found,
            Err(reason) => {
                tell(
                    &self.0.warning,
                    &format!("kept results cannot be read: {reason}"),
                );
                *file = None;
                None
            }
        }
    }

    /// Whether there is a result of that name; it may turn out to be broken.
    pub fn has(&self, key: &Key) -> bool {
        let file = lock(&self.0.file);
        file.as_ref().is_some_and(|file| file.has(key))
    }

    /// Who computed a result that is kept; nothing where that was a master.
    pub fn origin(&self, key: &Key) -> Option<Origin> {
        lock(&self.0.file).as_mut()?.origin(key).ok().flatten()
    }

    /// Keeps a result, sooner or later, with who computed it, where that was a worker.
    pub fn put(&self, key: Key, rows: &Arc<PackedRows>, origin: Option<Origin>) {
        self.write(Written::Result(key, rows.clone(), origin));
    }

    /// Notes that a result was computed again, and is right.
    pub fn audited(&self, key: Key) {
        self.write(Written::Audited(key));
    }

    /// Lets go of all results of a worker, those of earlier solves too.
    pub fn drop_of(&self, worker: &str) {
        let worker: Arc<str> = worker.into();
        lock(&self.0.distrusted).insert(worker.clone());
        self.write(Written::Without(worker));
    }

    fn write(&self, what: Written) {
        if self.0.closed.load(Ordering::Relaxed) {
            return;
        }
        let sender = lock(&self.0.waiting).clone();
        if let Some(sender) = sender
            && sender.send(what).is_err()
        {
            // the writer has given up, and said why
            self.0.closed.store(true, Ordering::Relaxed);
        }
    }

    /// What went wrong since this was asked last.
    pub fn warning(&self) -> Option<String> {
        lock(&self.0.warning).take()
    }

    /// Bytes of all results that are kept.
    pub fn bytes(&self) -> u64 {
        lock(&self.0.file).as_ref().map_or(0, File::bytes)
    }

    /// Waits until everything is written. Nothing is kept afterwards.
    pub fn close(&self) {
        drop(lock(&self.0.waiting).take());
        if let Some(writer) = lock(&self.0.writer).take() {
            // a panic there has been shown
            let _ = writer.join();
        }
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        drop(lock(&self.waiting).take());
        if let Some(writer) = lock(&self.writer).take() {
            // a panic there has been shown
            let _ = writer.join();
        }
    }
}

/// Writes what comes, all that is waiting at once.
fn write(waiting: &Receiver<Written>, file: &Mutex<Option<File>>, warning: &Mutex<Option<String>>) {
    while let Ok(first) = waiting.recv() {
        let mut what = vec![first];
        what.extend(waiting.try_iter().take(WAITING));
        let mut file = lock(file);
        let Some(open) = file.as_mut() else { return };
        if let Err(reason) = open.write(what) {
            tell(
                warning,
                &format!("results are no longer kept: {reason}; the solve continues"),
            );
            *file = None;
            return;
        }
    }
}

fn tell(warning: &Mutex<Option<String>>, text: &str) {
    tracing::warn!("{text}");
    *lock(warning) = Some(text.to_owned());
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    // what is behind is whole, or fails by itself
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests;
