//! Where a run takes place: a folder that goes with it, and small disks that can be filled.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

/// The folder of a run.
pub(crate) struct Ground {
    folder: TempDir,
    pub(crate) state: Disk,
    pub(crate) log: Disk,
    pub(crate) out: Disk,
}

impl Ground {
    pub(crate) fn lay() -> io::Result<Self> {
        let folder = tempfile::Builder::new().prefix("chaos-").tempdir()?;
        let disk = |name: &str, kibibytes| Disk::mount(&folder.path().join(name), kibibytes);
        Ok(Self {
            state: disk("state", 64 << 10)?,
            log: disk("log", 4 << 10)?,
            out: disk("full", 64)?,
            folder,
        })
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }
}

/// A disk of a few kilobytes in memory; a plain folder where nothing may be mounted.
pub(crate) struct Disk {
    pub(crate) path: PathBuf,
    pub(crate) is_mounted: bool,
}

impl Disk {
    fn mount(path: &Path, kibibytes: u64) -> io::Result<Self> {
        fs::create_dir(path)?;
        let mount = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &format!("size={kibibytes}k"), "chaos"])
            .arg(path)
            .output();
        Ok(Self {
            path: path.to_owned(),
            is_mounted: mount.is_ok_and(|output| output.status.success()),
        })
    }

    /// Takes all its room; nothing more can be written.
    pub(crate) fn fill(&self) -> io::Result<()> {
        let mut file = File::create(self.path.join("filler"))?;
        for size in [64 << 10, 4 << 10, 1] {
            let block = vec![0; size];
            while file.write_all(&block).is_ok() {}
        }
        Ok(())
    }

    /// Gives the room back.
    pub(crate) fn free(&self) {
        // it may not have been filled
        let _ = fs::remove_file(self.path.join("filler"));
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        if self.is_mounted {
            // lazily: somebody may still be writing there
            let _ = Command::new("umount").arg("-l").arg(&self.path).status();
        }
    }
}
