//! What was computed, one line each, so that a study that was cut short goes on where it ended.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use nestrad_common::bounded::{self, Limit, with_line_feeds};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Some hundred bytes are a run.
const LIMIT: Limit = Limit::fixed(256 << 20);

/// Lines of JSON, each a key and a record. The last record of a key counts.
#[derive(Debug)]
pub struct Ledger<R> {
    path: PathBuf,
    file: File,
    records: HashMap<String, R>,
    unreadable: Vec<usize>,
}

#[derive(Deserialize, Serialize)]
struct Keyed<R> {
    key: String,
    record: R,
}

/// Why a ledger cannot be used.
#[derive(Debug, Error)]
pub enum LedgerError {
    /// The file cannot be read or written.
    #[error("{}: cannot be read or written", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        #[source]
        source: io::Error,
    },
    /// A record does not come back from its line.
    #[error("{}: a record cannot be written as a line", path.display())]
    Record {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        source: serde_json::Error,
    },
}

impl<R: Serialize + DeserializeOwned> Ledger<R> {
    /// Opens a file, which is made with its folder if there is none. What is no record (half a line, where a study was
    /// killed) is passed over.
    pub fn open(path: &Path) -> Result<Self, LedgerError> {
        let failed = |source| LedgerError::Io {
            path: path.to_owned(),
            source,
        };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(failed)?;
        }
        let text = match bounded::read(path, LIMIT) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            read => read.map_err(failed)?,
        };
        let (mut records, mut unreadable) = (HashMap::new(), Vec::new());
        let lines = with_line_feeds(&text);
        for (number, line) in lines.split(|&byte| byte == b'\n').enumerate() {
            match serde_json::from_slice::<Keyed<R>>(line) {
                Ok(Keyed { key, record }) => {
                    records.insert(key, record);
                }
                Err(_) if line.is_empty() => {}
                Err(_) => unreadable.push(number + 1),
            }
        }
        let mut options = OpenOptions::new();
        let mut file = options
            .create(true)
            .append(true)
            .open(path)
            .map_err(failed)?;
        if lines.last().is_some_and(|&last| last != b'\n') {
            file.write_all(b"\n").map_err(failed)?;
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            records,
            unreadable,
        })
    }

    /// Numbers of lines, from 1, that hold no record.
    pub fn unreadable(&self) -> &[usize] {
        &self.unreadable
    }

    /// The record of a key.
    pub fn get(&self, key: &str) -> Option<&R> {
        self.records.get(key)
    }

    /// Writes a record, and keeps it as it is read back: a study that is resumed has the same bits.
    pub fn add(&mut self, key: &str, record: R) -> Result<(), LedgerError> {
        let path = &self.path;
        let wrong = |source| LedgerError::Record {
            path: path.clone(),
            source,
        };
        let key = key.to_owned();
        let mut text = serde_json::to_string(&Keyed { key, record }).map_err(wrong)?;
        let Keyed { key, record } = serde_json::from_str(&text).map_err(wrong)?;
        text.push('\n');
        let written = self.file.write_all(text.as_bytes());
        let written = written.and_then(|()| self.file.sync_data());
        written.map_err(|source| LedgerError::Io {
            path: path.clone(),
            source,
        })?;
        self.records.insert(key, record);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_a_line_is_passed_over_and_the_rest_comes_back() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("trade.jsonl");
        let mut ledger = Ledger::open(&path).expect("opened");
        ledger.add("a", 0.1 + 0.2).expect("written");
        ledger.add("b", 2.0).expect("written");
        let (a, b) = (ledger.get("a").copied(), ledger.get("b").copied());
        assert_eq!((a.is_some(), b), (true, Some(2.0)));
        drop(ledger);

        // killed in the middle of the second line
        let text = std::fs::read(&path).expect("read");
        std::fs::write(&path, &text[..text.len() - 5]).expect("cut");
        let mut ledger = Ledger::<f64>::open(&path).expect("opened");
        assert_eq!((ledger.get("a").copied(), ledger.get("b")), (a, None));
        assert_eq!(ledger.unreadable(), [2]);
        ledger.add("b", 3.0).expect("written");
        drop(ledger);
        let ledger = Ledger::<f64>::open(&path).expect("opened");
        assert_eq!(
            (ledger.get("a").copied(), ledger.get("b").copied()),
            (a, Some(3.0))
        );
    }

    #[test]
    fn what_does_not_come_back_is_an_error_and_leaves_no_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("trade.jsonl");
        let mut ledger = Ledger::open(&path).expect("opened");
        assert!(ledger.add("a", f64::NAN).is_err());
        assert_eq!(std::fs::read(&path).expect("read"), b"");
        let error = Ledger::<f64>::open(folder.path()).expect_err("a folder");
        assert!(error.to_string().contains("cannot be read"), "{error}");
    }
}
