//! The file of a store: one redb database.

use std::collections::BTreeSet;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nestrad_common::panics;
use nestrad_engine::exchange::Origin;
use nestrad_kernel::PackedRows;
use nestrad_kernel::rows::Counts;
use redb::{Database, ReadableDatabase, ReadableTable, Table, TableDefinition};

use super::{Key, Written};

/// Results by name: a BLAKE3 of what follows it, four counters, the packed rows.
const RESULTS: TableDefinition<&[u8], &[u8]> = TableDefinition::new("results");

/// Names and sizes of results, by the order in which they came.
const ORDER: TableDefinition<u64, (&[u8], u64)> = TableDefinition::new("order");

/// Which worker computed a result, by name, and whether the master computed it again and found the same; there is none
/// of what a master computed.
const ORIGINS: TableDefinition<&[u8], (&str, bool)> = TableDefinition::new("origins");

/// Checksum and counters.
const HEAD: usize = 32 + 4 * 8;

/// Memory for pages of the file, bytes.
const CACHE_BYTES: usize = 16 << 20;

/// A result, and which worker computed it.
type Kept = (Key, Arc<PackedRows>, Option<Origin>);

pub(super) struct File {
    database: Guarded,
    path: PathBuf,
    /// Of all results.
    bytes: u64,
    /// Of the file.
    most_bytes: u64,
    next: u64,
}

/// A file grows by doubling, and has pages of powers of two: so that it never exceeds its bound, it is made to
/// take no more than half of that between writes, and results no more than a quarter. No file is smaller than
/// `LEAST_BYTES`.
const AT_REST: u64 = 2;
const FILLED: u64 = 4;
const LEAST_BYTES: u64 = 2 << 20;

pub(super) enum FileError {
    InUse,
    /// The disk is full, may not be written to, or fails: the file may be whole.
    Disk(String),
    /// What is in the file is not what was written.
    Broken(String),
}

impl From<redb::Error> for FileError {
    fn from(error: redb::Error) -> Self {
        match error {
            redb::Error::DatabaseAlreadyOpen => Self::InUse,
            redb::Error::Io(error) => match error.kind() {
                // what redb says of a file that is none of its own, or ends too soon
                ErrorKind::InvalidData => Self::Broken("the file is no store".to_owned()),
                ErrorKind::UnexpectedEof => Self::Broken("the file is broken".to_owned()),
                _ => Self::Disk(error.to_string()),
            },
            redb::Error::PreviousIo => Self::Disk("the disk failed before".to_owned()),
            error => Self::Broken(error.to_string()),
        }
    }
}

/// A library that meets bytes it did not write may panic: that is a fault of the file, and what the panic says is
/// shown to nobody.
fn guarded<T>(what: impl FnOnce() -> Result<T, redb::Error>) -> Result<T, FileError> {
    match panics::caught_silently(what) {
        Ok(done) => done.map_err(FileError::from),
        Err(_) => Err(FileError::Broken("the file is broken".to_owned())),
    }
}

/// A database that is closed as everything else is done with it.
struct Guarded(Option<Database>);

impl Drop for Guarded {
    fn drop(&mut self) {
        let database = self.0.take();
        // what cannot be closed well is repaired when it is opened
        let _ = guarded(|| {
            drop(database);
            Ok(())
        });
    }
}

impl Guarded {
    fn get(&self) -> Result<&Database, redb::Error> {
        self.0.as_ref().ok_or(redb::Error::DatabaseClosed)
    }

    fn get_mut(&mut self) -> Result<&mut Database, redb::Error> {
        self.0.as_mut().ok_or(redb::Error::DatabaseClosed)
    }
}

impl File {
    pub(super) fn open(path: &Path, most_bytes: u64) -> Result<Self, FileError> {
        let mut builder = Database::builder();
        let database = guarded(|| Ok(builder.set_cache_size(CACHE_BYTES).create(path)?))?;
        let mut file = Self {
            database: Guarded(Some(database)),
            path: path.to_owned(),
            bytes: 0,
            most_bytes,
            next: 0,
        };
        (file.bytes, file.next) = guarded(|| {
            let begun = file.database.get()?.begin_write()?;
            let (mut bytes, mut next) = (0, 0);
            {
                begun.open_table(RESULTS)?;
                begun.open_table(ORIGINS)?;
                for entry in begun.open_table(ORDER)?.iter()? {
                    let (number, of) = entry?;
                    bytes = of.value().1.saturating_add(bytes);
                    next = number.value().saturating_add(1);
                }
            }
            begun.commit()?;
            Ok((bytes, next))
        })?;
        file.bound()?;
        Ok(file)
    }

    /// Length of the file.
    fn length(&self) -> u64 {
        fs::metadata(&self.path).map_or(0, |file| file.len())
    }

    /// Most bytes of all results.
    fn most_results(&self) -> u64 {
        self.most_bytes / FILLED
    }

    /// Makes the file as small as it is to be: lets go of the oldest results, and of the room of those that
    /// are gone.
    fn bound(&mut self) -> Result<(), FileError> {
        let mut most = self.most_results();
        let at_rest = (self.most_bytes / AT_REST).max(LEAST_BYTES);
        if self.bytes > most {
            self.drop_to(most)?;
        }
        while self.length() > at_rest {
            let database = &mut self.database;
            guarded(|| {
                while database.get_mut()?.compact()? {}
                Ok(())
            })?;
            if self.length() <= at_rest || self.bytes == 0 {
                break;
            }
            most = most.min(self.bytes) / 4 * 3;
            self.drop_to(most)?;
        }
        Ok(())
    }

    fn drop_to(&mut self, most: u64) -> Result<(), FileError> {
        let mut bytes = self.bytes;
        self.bytes = guarded(|| {
            let begun = self.database.get()?.begin_write()?;
            {
                let mut by_name = begun.open_table(RESULTS)?;
                let mut order = begun.open_table(ORDER)?;
                let mut origins = begun.open_table(ORIGINS)?;
                drop_oldest(&mut by_name, &mut order, &mut origins, (&mut bytes, most))?;
            }
            begun.commit()?;
            Ok(bytes)
        })?;
        Ok(())
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The result of that name; nothing where it is not whole.
    pub(super) fn get(&self, key: &Key) -> Result<Option<PackedRows>, String> {
        let read = guarded(|| {
            let begun = self.database.get()?.begin_read()?;
            let found = begun.open_table(RESULTS)?.get(&key[..])?;
            Ok(found.and_then(|found| unpack(found.value())))
        });
        read.map_err(FileError::text)
    }

    /// Whether there is a result of that name.
    pub(super) fn has(&self, key: &Key) -> bool {
        let found = guarded(|| {
            let begun = self.database.get()?.begin_read()?;
            Ok(begun.open_table(RESULTS)?.get(&key[..])?.is_some())
        });
        found.unwrap_or(false)
    }

    /// Who computed the result of that name, where it was a worker.
    pub(super) fn origin(&self, key: &Key) -> Result<Option<Origin>, String> {
        let read = guarded(|| {
            let begun = self.database.get()?.begin_read()?;
            let found = begun.open_table(ORIGINS)?.get(&key[..])?;
            Ok(found.map(|found| {
                let (worker, audited) = found.value();
                Origin {
                    worker: worker.into(),
                    audited,
                }
            }))
        });
        read.map_err(FileError::text)
    }

    /// Does what is to be done, in its order.
    pub(super) fn write(&mut self, what: Vec<Written>) -> Result<(), String> {
        let mut results = Vec::new();
        for one in what {
            match one {
                Written::Result(key, rows, origin) => results.push((key, rows, origin)),
                Written::Audited(key) => {
                    self.put(&std::mem::take(&mut results))?;
                    self.note_audited(&key).map_err(FileError::text)?;
                }
                Written::Without(worker) => {
                    self.put(&std::mem::take(&mut results))?;
                    self.drop_of(&worker).map_err(FileError::text)?;
                }
            }
        }
        self.put(&results)
    }

    fn note_audited(&mut self, key: &Key) -> Result<(), FileError> {
        guarded(|| {
            let begun = self.database.get()?.begin_write()?;
            {
                let mut origins = begun.open_table(ORIGINS)?;
                let worker = origins.get(&key[..])?.map(|of| of.value().0.to_owned());
                if let Some(worker) = worker {
                    origins.insert(&key[..], (&worker[..], true))?;
                }
            }
            begun.commit()?;
            Ok(())
        })
    }

    fn drop_of(&mut self, worker: &str) -> Result<(), FileError> {
        let mut bytes = self.bytes;
        self.bytes = guarded(|| {
            let begun = self.database.get()?.begin_write()?;
            {
                let mut by_name = begun.open_table(RESULTS)?;
                let mut order = begun.open_table(ORDER)?;
                let mut origins = begun.open_table(ORIGINS)?;
                let mut theirs = BTreeSet::new();
                for origin in origins.iter()? {
                    let (name, of) = origin?;
                    if of.value().0 == worker {
                        theirs.insert(name.value().to_vec());
                    }
                }
                for name in &theirs {
                    by_name.remove(&name[..])?;
                    origins.remove(&name[..])?;
                }
                order.retain(|_, (name, size)| {
                    let goes = theirs.contains(name);
                    bytes = bytes.saturating_sub(if goes { size } else { 0 });
                    !goes
                })?;
            }
            begun.commit()?;
            Ok(bytes)
        })?;
        Ok(())
    }

    /// Keeps results, and lets go of the oldest ones where they are too many.
    fn put(&mut self, results: &[Kept]) -> Result<(), String> {
        // what is written at a time stands beside what it takes the place of
        let most = (self.most_results() / 2).max(1) as usize;
        let mut taken = 0;
        let together = results.chunk_by(|(_, a, _), (_, b, _)| {
            taken = if taken == 0 { a.packed.len() } else { taken } + b.packed.len();
            let fits = taken <= most;
            taken = if fits { taken } else { 0 };
            fits
        });
        for some in together {
            self.put_together(some)?;
        }
        Ok(())
    }

    fn put_together(&mut self, results: &[Kept]) -> Result<(), String> {
        let most = self.most_results();
        let written = guarded(|| {
            let (mut bytes, mut next) = (self.bytes, self.next);
            let begun = self.database.get()?.begin_write()?;
            {
                let mut by_name = begun.open_table(RESULTS)?;
                let mut order = begun.open_table(ORDER)?;
                let mut origins = begun.open_table(ORIGINS)?;
                for (key, rows, origin) in results {
                    let value = pack(rows);
                    let size = value.len() as u64;
                    if size > most {
                        continue;
                    }
                    match origin {
                        Some(of) => origins.insert(&key[..], (&*of.worker, of.audited))?,
                        None => origins.remove(&key[..])?,
                    };
                    // a broken one is written over, and keeps its place
                    if by_name.insert(&key[..], &value[..])?.is_some() {
                        continue;
                    }
                    order.insert(next, (&key[..], size))?;
                    (bytes, next) = (bytes + size, next + 1);
                    drop_oldest(&mut by_name, &mut order, &mut origins, (&mut bytes, most))?;
                }
            }
            begun.commit()?;
            Ok((bytes, next))
        });
        (self.bytes, self.next) = written.map_err(FileError::text)?;
        self.bound().map_err(FileError::text)
    }
}

/// Lets go of the oldest results until they take no more than that.
fn drop_oldest(
    by_name: &mut Table<&[u8], &[u8]>,
    order: &mut Table<u64, (&[u8], u64)>,
    origins: &mut Table<&[u8], (&str, bool)>,
    (bytes, most): (&mut u64, u64),
) -> Result<(), redb::Error> {
    while *bytes > most {
        let Some((_, oldest)) = order.pop_first()? else {
            // a file that is damaged may count wrongly
            *bytes = 0;
            break;
        };
        let (name, size) = oldest.value();
        by_name.remove(name)?;
        origins.remove(name)?;
        *bytes = bytes.saturating_sub(size);
    }
    Ok(())
}

impl FileError {
    fn text(self) -> String {
        match self {
            Self::InUse => "in use".to_owned(),
            Self::Disk(reason) | Self::Broken(reason) => reason,
        }
    }
}

fn pack(rows: &PackedRows) -> Vec<u8> {
    let mut value = vec![0; 32];
    let counts = rows.counts;
    for number in [
        counts.lines,
        counts.segments,
        counts.rays,
        counts.row_entries,
    ] {
        value.extend_from_slice(&number.to_le_bytes());
    }
    value.extend_from_slice(&rows.packed);
    let checksum = *blake3::hash(&value[32..]).as_bytes();
    value[..32].copy_from_slice(&checksum);
    value
}

fn unpack(value: &[u8]) -> Option<PackedRows> {
    let (checksum, rest) = value.split_first_chunk::<32>()?;
    if value.len() < HEAD || blake3::hash(rest).as_bytes() != checksum {
        return None;
    }
    let number = |k: usize| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&rest[8 * k..8 * (k + 1)]);
        u64::from_le_bytes(bytes)
    };
    Some(PackedRows {
        counts: Counts {
            lines: number(0),
            segments: number(1),
            rays: number(2),
            row_entries: number(3),
        },
        packed: value[HEAD..].to_vec(),
    })
}
