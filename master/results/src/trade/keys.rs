//! Names of runs in the ledger: what a run depends on has a part in its name.

use std::fmt::{self, Write as _};

use nestrad_common::scene::Scene;

struct Hashing(blake3::Hasher);

impl fmt::Write for Hashing {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

/// Names a scene, and the program that solves it: numbers are written so that they read back.
pub(super) fn digest(scene: &Scene) -> String {
    let mut hasher = Hashing(blake3::Hasher::new());
    let (version, kernel) = (env!("CARGO_PKG_VERSION"), nestrad_kernel::kernel());
    // a hasher takes all that it gets
    let _ = write!(hasher, "{version}\n{kernel}\n{scene:?}");
    hasher.0.finalize().to_hex().to_string()
}

/// A name of parts.
pub(super) fn key(parts: &[&str]) -> String {
    let mut hasher = blake3::Hasher::new();
    for part in parts {
        hasher.update(&(part.len() as u64).to_le_bytes());
        hasher.update(part.as_bytes());
    }
    hasher.finalize().to_hex().to_string()
}
