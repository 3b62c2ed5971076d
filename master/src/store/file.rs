//! The file of a store: one redb database.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use bytes::Bytes;
use redb::{Database, DatabaseError, ReadableDatabase, ReadableTable, TableDefinition};

use super::Key;
use crate::exchange::{JobRows, Traced};

/// Results by name: a BLAKE3 of what follows it, four counters, the packed rows.
const RESULTS: TableDefinition<&[u8], &[u8]> = TableDefinition::new("results");

/// Names and sizes of results, by the order in which they came.
const ORDER: TableDefinition<u64, (&[u8], u64)> = TableDefinition::new("order");

/// Checksum and counters.
const HEAD: usize = 32 + 4 * 8;

/// Memory for pages of the file, bytes.
const CACHE_BYTES: usize = 16 << 20;

pub(super) struct File {
    database: Database,
    /// Of all results.
    bytes: u64,
    most_bytes: u64,
    next: u64,
}

pub(super) enum FileError {
    InUse,
    Other(String),
}

impl From<redb::Error> for FileError {
    fn from(error: redb::Error) -> Self {
        Self::Other(error.to_string())
    }
}

/// A library that meets bytes it did not write may panic: that is a fault of the file.
fn guarded<T>(what: impl FnOnce() -> Result<T, redb::Error>) -> Result<T, FileError> {
    catch_unwind(AssertUnwindSafe(what))
        .unwrap_or_else(|_| Err(redb::Error::Corrupted("the file is broken".to_owned())))
        .map_err(FileError::from)
}

impl File {
    pub(super) fn open(path: &Path, most_bytes: u64) -> Result<Self, FileError> {
        let opened = catch_unwind(|| Database::builder().set_cache_size(CACHE_BYTES).create(path));
        let database = match opened {
            Ok(Ok(database)) => database,
            Ok(Err(DatabaseError::DatabaseAlreadyOpen)) => return Err(FileError::InUse),
            Ok(Err(error)) => return Err(FileError::Other(error.to_string())),
            Err(_) => return Err(FileError::Other("the file is broken".to_owned())),
        };
        guarded(|| {
            let begun = database.begin_write()?;
            let (mut bytes, mut next) = (0, 0);
            {
                begun.open_table(RESULTS)?;
                for entry in begun.open_table(ORDER)?.iter()? {
                    let (number, of) = entry?;
                    bytes += of.value().1;
                    next = number.value() + 1;
                }
            }
            begun.commit()?;
            Ok((bytes, next))
        })
        .map(|(bytes, next)| Self {
            database,
            bytes,
            most_bytes,
            next,
        })
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// The result of that name; nothing where it is not whole.
    pub(super) fn get(&self, key: &Key) -> Result<Option<JobRows>, String> {
        let read = guarded(|| {
            let begun = self.database.begin_read()?;
            let found = begun.open_table(RESULTS)?.get(&key[..])?;
            Ok(found.map(|found| Bytes::copy_from_slice(found.value())))
        });
        read.map(|found| found.and_then(|found| unpack(&found)))
            .map_err(|error| error.text())
    }

    /// Whether there is a result of that name.
    pub(super) fn has(&self, key: &Key) -> bool {
        let found = guarded(|| {
            let begun = self.database.begin_read()?;
            Ok(begun.open_table(RESULTS)?.get(&key[..])?.is_some())
        });
        found.unwrap_or(false)
    }

    /// Keeps results, and lets go of the oldest ones where they are too many.
    pub(super) fn put(&mut self, results: &[(Key, JobRows)]) -> Result<(), String> {
        let written = guarded(|| {
            let (mut bytes, mut next) = (self.bytes, self.next);
            let begun = self.database.begin_write()?;
            {
                let mut by_name = begun.open_table(RESULTS)?;
                let mut order = begun.open_table(ORDER)?;
                for (key, rows) in results {
                    let value = pack(rows);
                    let size = value.len() as u64;
                    if size > self.most_bytes {
                        continue;
                    }
                    // a broken one is written over, and keeps its place
                    if by_name.insert(&key[..], &value[..])?.is_some() {
                        continue;
                    }
                    order.insert(next, (&key[..], size))?;
                    (bytes, next) = (bytes + size, next + 1);
                    while bytes > self.most_bytes {
                        let Some((_, oldest)) = order.pop_first()? else {
                            break;
                        };
                        let (name, size) = oldest.value();
                        by_name.remove(name)?;
                        bytes -= size;
                    }
                }
            }
            begun.commit()?;
            Ok((bytes, next))
        });
        (self.bytes, self.next) = written.map_err(|error| error.text())?;
        Ok(())
    }
}

impl FileError {
    fn text(self) -> String {
        match self {
            Self::InUse => "in use".to_owned(),
            Self::Other(reason) => reason,
        }
    }
}

fn pack(rows: &JobRows) -> Vec<u8> {
    let mut value = vec![0; 32];
    let traced = rows.traced;
    for number in [
        traced.lines,
        traced.segments,
        traced.rays,
        traced.row_entries,
    ] {
        value.extend_from_slice(&number.to_le_bytes());
    }
    value.extend_from_slice(&rows.packed);
    let checksum = *blake3::hash(&value[32..]).as_bytes();
    value[..32].copy_from_slice(&checksum);
    value
}

fn unpack(value: &Bytes) -> Option<JobRows> {
    let (checksum, rest) = value.split_first_chunk::<32>()?;
    if value.len() < HEAD || blake3::hash(rest).as_bytes() != checksum {
        return None;
    }
    let number = |k: usize| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&rest[8 * k..8 * (k + 1)]);
        u64::from_le_bytes(bytes)
    };
    Some(JobRows {
        traced: Traced {
            lines: number(0),
            segments: number(1),
            rays: number(2),
            row_entries: number(3),
        },
        packed: value.slice(HEAD..),
    })
}
