//! Files that are whole or not there: written beside their place, then renamed into it.
//!
//! A result is a folder of several files. All of them are first written and synced to disk in a
//! hidden folder inside the result folder (so on the same file system), and only when the last one
//! is safe are they renamed, one by one, over what an earlier run left. Until then the folder is as
//! it was, whatever happens: an error, a full disk, a kill. A folder cannot be exchanged for another
//! in one step everywhere, and it may hold the user's own files or be a mount point; so between the
//! first rename and the last the new files are mixed with old ones. That is made visible: the *seal*
//! (`summary.json`) is taken away before the first rename and comes back last. A folder that has its
//! seal holds one whole result and nothing of another.
//!
//! A process that is killed leaves its hidden folder (`.nestrad-` and six letters) behind. It is not
//! removed by later runs, which cannot tell it from that of a run still at work.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::error::{Fault, OutputError};

/// Refuses a folder that files of these names could not be written into: it cannot be made or written, or something
/// stands in the way. It is not made, and nothing in it changes: this is for the beginning of a long computation, which
/// may still fail.
pub fn check_writable(folder: &Path, names: &[&str]) -> Result<(), OutputError> {
    // "" is the parent of a relative name; a link that leads nowhere is there too
    let there = |at: &&Path| at.as_os_str().is_empty() || at.symlink_metadata().is_ok();
    let nearest = folder.ancestors().find(there).unwrap_or(folder);
    let nearest = if nearest.as_os_str().is_empty() {
        Path::new(".")
    } else {
        nearest
    };
    tempfile::tempfile_in(nearest)
        .map(drop)
        .map_err(|error| OutputError::at(folder, error))?;
    no_folders(folder, names.iter().copied())
}

/// Refuses folders where files are to be.
fn no_folders<'a>(
    folder: &Path,
    names: impl IntoIterator<Item = &'a str>,
) -> Result<(), OutputError> {
    let mut places = names.into_iter().map(|name| folder.join(name));
    match places.find(|place| place.is_dir()) {
        Some(place) => Err(OutputError::at(&place, Fault::IsFolder)),
        None => Ok(()),
    }
}

/// A folder that is about to be given new files.
#[derive(Debug)]
pub struct Staging {
    folder: PathBuf,
    /// Deleted with all that is still in it when this value goes.
    beside: TempDir,
    names: Vec<String>,
}

impl Staging {
    /// Begins new contents for `folder`, which is made if there is none.
    pub fn begin(folder: &Path) -> Result<Self, OutputError> {
        let at = |error| OutputError::at(folder, Fault::Io(error));
        fs::create_dir_all(folder).map_err(at)?;
        let beside = tempfile::Builder::new()
            .prefix(".nestrad-")
            .tempdir_in(folder)
            .map_err(at)?;
        Ok(Self {
            folder: folder.to_owned(),
            beside,
            names: Vec::new(),
        })
    }

    /// Writes one file, which keeps its place beside the others until [`Staging::commit`]. It is on
    /// the disk when this returns.
    pub fn write(
        &mut self,
        name: &str,
        content: impl FnOnce(&mut BufWriter<File>) -> Result<(), Fault>,
    ) -> Result<(), OutputError> {
        let place = self.folder.join(name);
        let fill = || -> Result<(), Fault> {
            let file = File::create(self.beside.path().join(name))?;
            let mut out = BufWriter::with_capacity(1 << 16, file);
            content(&mut out)?;
            let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
            file.sync_all()?;
            Ok(())
        };
        fill().map_err(|fault| OutputError::at(&place, fault))?;
        self.names.push(name.to_owned());
        Ok(())
    }

    /// Puts all files in their places, `seal` last, and removes those of the `stale` names that are
    /// not among them (what an earlier run wrote and this one did not).
    pub fn commit(mut self, seal: &str, stale: &[&str]) -> Result<(), OutputError> {
        let own = self.names.iter().map(String::as_str);
        no_folders(&self.folder, own.chain(stale.iter().copied()))?;
        self.remove(seal)?;
        for name in stale
            .iter()
            .filter(|name| !self.names.iter().any(|own| own == *name))
        {
            self.remove(name)?;
        }
        // false comes before true: the seal goes last
        self.names.sort_by_key(|name| name == seal);
        for name in &self.names {
            let place = self.folder.join(name);
            fs::rename(self.beside.path().join(name), &place)
                .map_err(|error| OutputError::at(&place, error))?;
        }
        let at = |error| OutputError::at(&self.folder, Fault::Io(error));
        self.beside.close().map_err(at)?;
        sync_folder(&self.folder).map_err(at)
    }

    fn remove(&self, name: &str) -> Result<(), OutputError> {
        let place = self.folder.join(name);
        match fs::remove_file(&place) {
            Err(error) if error.kind() != ErrorKind::NotFound => {
                Err(OutputError::at(&place, error))
            }
            _ => Ok(()),
        }
    }
}

/// Makes the renames themselves safe from a power failure; only Unix opens folders as files.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(unix) {
        File::open(folder)?.sync_all()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn put(staging: &mut Staging, name: &str, text: &str) {
        staging
            .write(name, |out| Ok(out.write_all(text.as_bytes())?))
            .expect("written");
    }

    fn listing(folder: &Path) -> Vec<(String, String)> {
        let mut files: Vec<_> = fs::read_dir(folder)
            .expect("readable")
            .map(|entry| entry.expect("an entry").path())
            .map(|path| {
                let name = path
                    .file_name()
                    .expect("a name")
                    .to_string_lossy()
                    .into_owned();
                (
                    name,
                    fs::read_to_string(&path).unwrap_or_else(|_| "(folder)".into()),
                )
            })
            .collect();
        files.sort();
        files
    }

    fn with_old_result() -> TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in [
            ("a.csv", "old a"),
            ("seal", "old"),
            ("z.csv", "old z"),
            ("my", "own"),
        ] {
            fs::write(folder.path().join(name), text).expect("written");
        }
        folder
    }

    #[test]
    fn replaces_all_removes_the_stale_and_keeps_the_rest() {
        let folder = with_old_result();
        let mut staging = Staging::begin(folder.path()).expect("begun");
        put(&mut staging, "seal", "new");
        put(&mut staging, "a.csv", "new a");
        put(&mut staging, "b.csv", "new b");
        staging
            .commit("seal", &["a.csv", "z.csv", "never.csv"])
            .expect("committed");
        let expected = [
            ("a.csv", "new a"),
            ("b.csv", "new b"),
            ("my", "own"),
            ("seal", "new"),
        ];
        assert_eq!(
            listing(folder.path()),
            expected.map(|(name, text)| (name.into(), text.into()))
        );
    }

    #[test]
    fn a_failure_on_the_way_leaves_the_old_files() {
        let folder = with_old_result();
        let before = listing(folder.path());
        let mut staging = Staging::begin(folder.path()).expect("begun");
        put(&mut staging, "a.csv", "new a");
        let error = staging
            .write("z.csv", |out| {
                out.write_all(b"half of ")?;
                Err(io::Error::from(ErrorKind::StorageFull).into())
            })
            .expect_err("the disk is full");
        drop(staging);
        let place = folder.path().join("z.csv");
        assert_eq!(
            error.to_string(),
            format!("cannot write {}", place.display())
        );
        assert_eq!(listing(folder.path()), before);
    }

    #[test]
    fn a_folder_in_the_way_is_seen_before_anything_is_renamed() {
        let folder = with_old_result();
        fs::create_dir(folder.path().join("b.csv")).expect("made");
        let before = listing(folder.path());
        let early = check_writable(folder.path(), &["a.csv", "b.csv"]).expect_err("in the way");
        assert!(early.to_string().ends_with("b.csv"), "{early}");
        let mut staging = Staging::begin(folder.path()).expect("begun");
        put(&mut staging, "a.csv", "new a");
        put(&mut staging, "b.csv", "new b");
        let error = staging.commit("seal", &["z.csv"]).expect_err("in the way");
        assert!(error.to_string().ends_with("b.csv"), "{error}");
        assert_eq!(listing(folder.path()), before);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_device_is_an_error_that_names_the_file() {
        let folder = with_old_result();
        let mut staging = Staging::begin(folder.path()).expect("begun");
        // /dev/full accepts nothing: what a full disk looks like when the buffer is flushed
        let link = staging.beside.path().join("a.csv");
        std::os::unix::fs::symlink("/dev/full", link).expect("linked");
        let error = staging
            .write("a.csv", |out| Ok(out.write_all(b"data")?))
            .expect_err("full");
        assert!(error.to_string().ends_with("a.csv"), "{error}");
    }

    #[test]
    fn a_folder_is_checked_without_a_trace() {
        let folder = with_old_result();
        let before = listing(folder.path());
        assert!(check_writable(folder.path(), &["a.csv", "b.csv"]).is_ok());
        assert!(check_writable(&folder.path().join("new").join("out"), &["a.csv"]).is_ok());
        assert!(check_writable(Path::new("no such folder"), &["a.csv"]).is_ok());
        assert_eq!(listing(folder.path()), before);
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_leads_nowhere_is_seen_before_the_work() {
        let folder = with_old_result();
        let link = folder.path().join("out");
        std::os::unix::fs::symlink("no/such/place", &link).expect("linked");
        assert!(check_writable(&link, &[]).is_err());
        assert!(check_writable(&link.join("more"), &[]).is_err());
    }

    #[test]
    fn an_impossible_folder_is_named() {
        let folder = with_old_result();
        let path = folder.path().join("my").join("out");
        let early = check_writable(&path, &[]).expect_err("a file is in the way");
        assert_eq!(
            early.to_string(),
            format!("cannot write {}", path.display())
        );
        let error = Staging::begin(&path).expect_err("a file is in the way");
        assert_eq!(
            error.to_string(),
            format!("cannot write {}", path.display())
        );
    }
}
