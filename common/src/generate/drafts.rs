//! Generated files: written aside first, and each with a check sum in its last line, by which it is known
//! again.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use flate2::CrcWriter;
use tempfile::TempDir;

use super::error::WriteError;
use crate::bounded::{self, Limit};
use crate::formats::read::MAX_GEOMETRY_BYTES;

/// Begins the last line; eight hexadecimal digits end it.
const LAST: &str = "# as nestrad generate wrote it: crc32 ";

/// Nothing larger is generated.
const LARGEST: Limit = Limit::fixed(MAX_GEOMETRY_BYTES);

/// Whether a file is, to the byte, what was generated once, or is not there at all.
pub(super) fn is_own(path: &Path) -> io::Result<bool> {
    let bytes = match bounded::read(path, LARGEST) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(true),
        Err(error) if error.kind() == ErrorKind::FileTooLarge => return Ok(false),
        Err(error) => return Err(error),
    };
    let last_len = LAST.len() + 9;
    let Some((text, last)) = bytes.split_at_checked(bytes.len().wrapping_sub(last_len)) else {
        return Ok(false);
    };
    let mut crc = flate2::Crc::new();
    crc.update(text);
    Ok(last == last_line(crc.sum()).as_bytes())
}

fn last_line(crc: u32) -> String {
    format!("{LAST}{crc:08x}\n")
}

/// Files that lie complete in a folder of their own, inside the one that they are for; it goes, with all that
/// is still in it, when this is dropped.
pub(super) struct Drafts<'a> {
    folder: &'a Path,
    aside: TempDir,
    names: Vec<String>,
}

impl<'a> Drafts<'a> {
    pub(super) fn begin(folder: &'a Path) -> Result<Self, WriteError> {
        let aside = fs::create_dir_all(folder).and_then(|()| {
            tempfile::Builder::new()
                .prefix(".nestrad-")
                .tempdir_in(folder)
        });
        Ok(Self {
            folder,
            aside: aside.map_err(at(folder))?,
            names: Vec::new(),
        })
    }

    pub(super) fn add(
        &mut self,
        name: &str,
        fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), WriteError> {
        let write = || {
            let file = BufWriter::new(File::create(self.aside.path().join(name))?);
            let mut out = CrcWriter::new(file);
            fill(&mut out)?;
            let last = last_line(out.crc().sum());
            let mut out = out.into_inner();
            out.write_all(last.as_bytes())?;
            let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.sync_all()
        };
        write().map_err(at(&self.folder.join(name)))?;
        self.names.push(name.to_owned());
        Ok(())
    }

    /// Puts them in their places, in the order in which they were added.
    pub(super) fn publish(self) -> Result<(), WriteError> {
        for path in self.names.iter().map(|name| self.folder.join(name)) {
            // before the first is moved, so that all or none are
            if path.is_dir() {
                return Err(at(&path)(ErrorKind::IsADirectory.into()));
            }
        }
        for name in &self.names {
            let path = self.folder.join(name);
            fs::rename(self.aside.path().join(name), &path).map_err(at(&path))?;
        }
        self.aside.close().map_err(at(self.folder))
    }
}

fn at(path: &Path) -> impl FnOnce(io::Error) -> WriteError {
    let path: PathBuf = path.to_owned();
    move |source| WriteError::Io { path, source }
}
