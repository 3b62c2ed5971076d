//! Moments that are done, in a file beside the result: a series that was stopped goes on from there.
//!
//! The file begins with a line that names it and with the key of its series, which is made of all that the results
//! depend on. Each record holds its lengths, the number of its moment, what is kept of it, and a hash of all that. What
//! follows the last whole record is cut off: it was being written when the process ended.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use super::step::{OrganStep, StepFacts, StepResult};

const NAME: &[u8] = b"nestrad series part 1\n";
const KEY: usize = 32;
const HASH: usize = 32;
/// Three lengths and numbers of 8 bytes before the rest of a record.
const HEAD: usize = 24;
/// Bytes of an organ in a band.
const ORGAN: usize = 32;
/// No record is larger: lengths beyond it are none.
const MOST_RECORD: u64 = 1 << 36;

/// A file of finished moments.
#[derive(Debug)]
pub struct Part {
    path: PathBuf,
    file: File,
}

/// Why moments cannot be kept.
#[derive(Debug, Error)]
pub enum PartError {
    /// The file system refused.
    #[error("cannot keep finished moments in {}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What it said.
        #[source]
        source: io::Error,
    },
    /// Another process works at the same series.
    #[error("{}: another process computes this very series: expected one at a time", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
}

impl Part {
    /// Opens the file of a series beside its result, and reads what is done.
    pub fn open(out: &Path, key: [u8; KEY]) -> Result<(Self, Vec<(usize, StepResult)>), PartError> {
        let path = place(out, &key);
        let at = |source| PartError::File {
            path: path.clone(),
            source,
        };
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(false);
        let mut file = options.open(&path).map_err(at)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Err(PartError::InUse { path }),
            // a file system that knows no locks
            Err(TryLockError::Error(_)) => {}
        }
        let (done, whole) = read(&mut file, &key).map_err(at)?;
        file.set_len(whole).map_err(at)?;
        file.seek(SeekFrom::Start(whole)).map_err(at)?;
        if whole == 0 {
            let head = [NAME, &key].concat();
            file.write_all(&head).map_err(at)?;
        }
        Ok((Self { path, file }, done))
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a moment; it is with the system when this returns, and on the disk soon.
    pub fn add(&mut self, number: usize, step: &StepResult) -> Result<(), PartError> {
        let written = record(number, step).and_then(|record| self.file.write_all(&record));
        written.map_err(|source| PartError::File {
            path: self.path.clone(),
            source,
        })
    }

    /// Takes the file away: the result is written.
    pub fn remove(self) -> Result<(), PartError> {
        drop(self.file);
        std::fs::remove_file(&self.path).map_err(|source| PartError::File {
            path: self.path,
            source,
        })
    }
}

/// `out.series-0123456789abcdef`, beside `out`.
fn place(out: &Path, key: &[u8; KEY]) -> PathBuf {
    let digits: String = key[..8].iter().map(|byte| format!("{byte:02x}")).collect();
    // "out/" and "out/." are "out"
    let whole: PathBuf = out.components().collect();
    let name = whole
        .file_name()
        .map_or_else(Default::default, ToOwned::to_owned);
    let mut file = name;
    file.push(format!(".series-{digits}"));
    whole.with_file_name(file)
}

fn record(number: usize, step: &StepResult) -> io::Result<Vec<u8>> {
    let facts = serde_json::to_vec(&step.facts)?;
    let mut bytes = Vec::with_capacity(HEAD + facts.len() + ORGAN * step.organs.len() + HASH);
    for value in [number, facts.len(), step.organs.len()] {
        bytes.extend_from_slice(&(value as u64).to_le_bytes());
    }
    bytes.extend_from_slice(&facts);
    for organ in &step.organs {
        for value in [
            organ.absorbed_W,
            organ.absorbed_direct_W,
            organ.absorbed_se_W,
            organ.absorbed_bias_W,
        ] {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    let hash = blake3::hash(&bytes);
    bytes.extend_from_slice(hash.as_bytes());
    Ok(bytes)
}

/// All whole records, and where the last of them ends; 0 where the file is not that of the series.
fn read(file: &mut File, key: &[u8; KEY]) -> io::Result<(Vec<(usize, StepResult)>, u64)> {
    let mut head = vec![0; NAME.len() + KEY];
    let size = file.metadata()?.len();
    if size < head.len() as u64 {
        return Ok((Vec::new(), 0));
    }
    file.read_exact(&mut head)?;
    if head != [NAME, key].concat() {
        return Ok((Vec::new(), 0));
    }
    let mut whole = head.len() as u64;
    let mut done = Vec::new();
    let mut reader = io::BufReader::with_capacity(1 << 20, file);
    while let Some((bytes, record)) = next(&mut reader, size - whole)? {
        done.push(record);
        whole += bytes;
    }
    Ok((done, whole))
}

/// The next record, with its length, if it is whole.
fn next(reader: &mut impl Read, left: u64) -> io::Result<Option<(u64, (usize, StepResult))>> {
    if left < (HEAD + HASH) as u64 {
        return Ok(None);
    }
    let mut bytes = vec![0; HEAD];
    reader.read_exact(&mut bytes)?;
    let [number, facts, organs] = [0, 8, 16].map(|at| u64_at(&bytes, at));
    let body = organs
        .checked_mul(ORGAN as u64)
        .and_then(|n| n.checked_add(facts));
    let Some(body) = body.filter(|&body| body <= MOST_RECORD.min(left - (HEAD + HASH) as u64))
    else {
        return Ok(None);
    };
    bytes.resize(HEAD + body as usize, 0);
    reader.read_exact(&mut bytes[HEAD..])?;
    let mut hash = [0; HASH];
    reader.read_exact(&mut hash)?;
    if blake3::hash(&bytes) != hash {
        return Ok(None);
    }
    let (facts, organs) = bytes[HEAD..].split_at(facts as usize);
    let Ok(facts) = serde_json::from_slice::<StepFacts>(facts) else {
        return Ok(None);
    };
    let organs = organs.chunks_exact(ORGAN).map(|organ| OrganStep {
        absorbed_W: f64_at(organ, 0),
        absorbed_direct_W: f64_at(organ, 8),
        absorbed_se_W: f64_at(organ, 16),
        absorbed_bias_W: f64_at(organ, 24),
    });
    let organs = organs.collect();
    let step = StepResult { organs, facts };
    Ok(Some(((bytes.len() + HASH) as u64, (number as usize, step))))
}

fn u64_at(bytes: &[u8], at: usize) -> u64 {
    let mut word = [0; 8];
    word.copy_from_slice(&bytes[at..at + 8]);
    u64::from_le_bytes(word)
}

fn f64_at(bytes: &[u8], at: usize) -> f64 {
    f64::from_bits(u64_at(bytes, at))
}

#[cfg(test)]
#[path = "part_tests.rs"]
mod tests;
