//! A folder with scenes in it, where `nestrad` runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use nestrad_common::assemble::{load, load_scene_file};
use nestrad_common::scene::Scene;
use tempfile::TempDir;

use crate::processes::{Master, finish, nestrad, said};

/// Two plants: a stem, a leaf that hangs over the pattern's edge, a leaf of two triangles.
const FILES: [(&str, &str); 6] = [
    (
        "plants.can",
        "p 1 100001000001 3 0.20 0.20 0 0.22 0.20 0 0.21 0.20 0.30\n\
         p 1 100001001001 3 0.10 0.10 0.25 0.45 0.12 0.28 0.20 0.40 0.30\n\
         p 1 100002001001 4 0.60 0.60 0.20 1.15 0.62 0.22 1.10 0.90 0.25 0.65 0.95 0.21\n",
    ),
    (
        "par.opt",
        "n 1\ns d 0.15\ne d 0.12 d 0.09 0.05 d 0.11 0.05\n",
    ),
    (
        "nir.opt",
        "n 1\ns d 0.25\ne d 0.50 d 0.44 0.45 d 0.46 0.44\n",
    ),
    (
        "day.light",
        "400 0.3 0.2 -0.9\n60 -0.5 0.1 -0.8\n40 0 0 -1\n",
    ),
    ("ground.8", "0 0\n1 1\n"),
    (
        "scene.toml",
        "scene = \"plants.can\"\npattern = \"ground.8\"\nsoil = -0.01\nlight = \"day.light\"\n\
         [[bands]]\nname = \"PAR\"\noptics = \"par.opt\"\n\
         [[bands]]\nname = \"NIR\"\noptics = \"nir.opt\"\n",
    ),
];

/// Tables that two runs of the same solve agree in, byte for byte.
pub const TABLES: [&str; 3] = ["organs.csv", "triangles.csv", "soil.csv"];

/// A folder that goes when this does.
pub struct Desk(TempDir);

impl Default for Desk {
    fn default() -> Self {
        Self::new()
    }
}

impl Desk {
    /// With `scene.toml`, which takes milliseconds to solve.
    pub fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        for (name, text) in FILES {
            fs::write(desk.path(name), text).unwrap();
        }
        desk
    }

    /// A file or folder in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.0.path()
    }

    /// Runs `nestrad` here.
    pub fn run(&self, args: &[&str]) -> Output {
        finish(nestrad(self.folder(), args))
    }

    /// Runs what must succeed.
    pub fn done(&self, args: &[&str]) -> Output {
        let output = self.run(args);
        assert!(output.status.success(), "{args:?}: {}", said(&output));
        output
    }

    /// A generated canopy in the folder `name`, whose scene file is `name/scene.toml`.
    pub fn maize(&self, name: &str, seed: &str) {
        self.done(&[
            "generate", "maize", "--rows", "1x1", "--seed", seed, "--out", name,
        ]);
    }

    /// The result tables in a folder.
    pub fn tables(&self, out: &str) -> [Vec<u8>; 3] {
        TABLES.map(|name| fs::read(self.path(out).join(name)).unwrap())
    }

    /// Solves here and at the master; the tables must be the same.
    pub fn compare(&self, scene: &str, more: &[&str], master: &Master) {
        let solve = |out: &str, place: &[&str]| {
            self.done(&[&["solve", scene, "--out", out], more, place].concat());
            self.tables(out)
        };
        let url = master.url();
        let here = solve("here", &[]);
        assert!(here == solve("there", &["--master", &url]), "{scene}");
    }

    /// What a scene file says.
    pub fn scene(&self, scene: &str) -> Scene {
        let inputs = load_scene_file(&self.path(scene)).unwrap();
        load(&inputs).unwrap().scene
    }
}
