//! Generated canopies are scenes like any other: what is written loads, and nothing is odd about it.

#![allow(clippy::unwrap_used, reason = "what cannot be set up fails the test")]

use std::num::NonZeroUsize;

use nestrad_common::assemble::{load, load_scene_file};
use nestrad_common::generate::{Bean, Generated, Maize, Overwrite, RandomCanopy};

fn loads_without_a_warning(canopy: Generated) {
    let folder = tempfile::tempdir().unwrap();
    canopy
        .write(folder.path(), "canopy", Overwrite::Own)
        .unwrap();
    let inputs = load_scene_file(&folder.path().join("scene.toml")).unwrap();
    let loaded = load(&inputs).unwrap();
    assert_eq!(loaded.inspection.warnings, [""; 0]);
    assert_eq!(loaded.scene.canopy.len(), canopy.triangles.len());
    assert_eq!(loaded.scene.optics.len(), 2);
    let sources = loaded.scene.light.sources(NonZeroUsize::MIN, 1);
    assert!(!sources.list.is_empty());
}

#[test]
fn maize_loads() {
    loads_without_a_warning(Maize::default().generate().unwrap());
}

#[test]
fn bean_loads() {
    loads_without_a_warning(Bean::default().generate().unwrap());
}

#[test]
fn a_random_canopy_loads() {
    loads_without_a_warning(RandomCanopy::default().generate().unwrap());
}
