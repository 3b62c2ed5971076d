//! A folder with a small scene in it, where `nestrad` runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// Two plants: a stem, a leaf that hangs over the pattern's edge, a leaf of two triangles.
const CAN: &str = "\
# two small plants
p 1 100001000001 3 0.20 0.20 0 0.22 0.20 0 0.21 0.20 0.30
p 1 100001001001 3 0.10 0.10 0.25 0.45 0.12 0.28 0.20 0.40 0.30
p 1 100002001001 4 0.60 0.60 0.20 1.15 0.62 0.22 1.10 0.90 0.25 0.65 0.95 0.21
";
const PAR: &str = "n 1\ns d 0.15\ne d 0.12 d 0.09 0.05 d 0.11 0.05\n";
const NIR: &str = "n 1\ns d 0.25\ne d 0.50 d 0.44 0.45 d 0.46 0.44\n";
const LIGHT: &str = "400 0.3 0.2 -0.9\n60 -0.5 0.1 -0.8\n40 0 0 -1\n";
const PATTERN: &str = "0 0\n1 1\n";
const SCENE: &str = "\
scene = \"plants.can\"
pattern = \"ground.8\"
soil = -0.01
light = \"day.light\"
[[bands]]
name = \"PAR\"
optics = \"par.opt\"
[[bands]]
name = \"NIR\"
optics = \"nir.opt\"
";

/// Solves the scene into `out`.
pub(crate) const SOLVE: [&str; 4] = ["solve", "scene.toml", "--out", "out"];

/// The same said in flags.
pub(crate) const SOLVE_BY_FLAGS: [&str; 14] = [
    "solve",
    "plants.can",
    "--optics",
    "PAR=par.opt",
    "--optics",
    "NIR=nir.opt",
    "--light",
    "day.light",
    "--pattern",
    "ground.8",
    "--soil",
    "-0.01",
    "--out",
    "out",
];

pub(crate) struct Desk(TempDir);

impl Desk {
    pub(crate) fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        for (name, text) in [
            ("plants.can", CAN),
            ("par.opt", PAR),
            ("nir.opt", NIR),
            ("day.light", LIGHT),
            ("ground.8", PATTERN),
            ("scene.toml", SCENE),
        ] {
            desk.put(name, text);
        }
        desk
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn put(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.path(name), content).unwrap();
    }

    pub(crate) fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nestrad"));
        command
            .args(args)
            .current_dir(self.0.path())
            .env_remove("RUST_BACKTRACE")
            .stdin(Stdio::null());
        command
    }

    pub(crate) fn run(&self, args: &[&str]) -> Ran {
        Ran::from(self.command(args).output().unwrap())
    }

    /// Runs what must succeed.
    pub(crate) fn done(&self, args: &[&str]) -> Ran {
        let ran = self.run(args);
        assert_eq!(ran.code, Some(0), "{args:?}: {}", ran.stderr);
        ran
    }
}

/// What a run said.
pub(crate) struct Ran {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

/// Names and contents of all files of a folder, hidden ones included.
pub(crate) fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut files: Vec<_> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap())
        })
        .collect();
    files.sort();
    files
}
