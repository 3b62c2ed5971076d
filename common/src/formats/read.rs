//! Files to bytes: the only place where a format touches the file system.

use std::io::{self, ErrorKind, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::error::FormatError;
use super::lines::MAX_LINE_BYTES;
use crate::bounded::{self, GZIP, Limit};
use crate::options::DEFAULT_MEMORY_GIB;

/// Geometry files, before and after decompression: 8 GiB is about 70 million triangles of text.
pub const MAX_GEOMETRY_BYTES: u64 = 8 << 30;

/// All other files are written by hand or hold a few numbers.
pub const SMALL: Limit = Limit::fixed(16 << 20);

/// What a geometry file may take of the memory that a solve may take: a canopy takes more than its text.
pub fn geometry_limit(memory_GiB: Option<f64>) -> Limit {
    let half_GiB = 0.5 * memory_GiB.unwrap_or(DEFAULT_MEMORY_GIB);
    let half = (half_GiB * f64::from(1 << 30)) as u64;
    let of = if half < MAX_GEOMETRY_BYTES {
        "half of --memory"
    } else {
        ""
    };
    Limit {
        bytes: half.clamp(SMALL.bytes, MAX_GEOMETRY_BYTES),
        of,
        line_bytes: Some(MAX_LINE_BYTES),
    }
}

/// Text of coordinates shrinks 5 to 10 times; a file that swells more than this is a bomb.
pub const MAX_GZIP_RATIO: u64 = 100;

/// Below this size the ratio is not looked at: little files of zeros are harmless.
const GZIP_RATIO_FROM_BYTES: u64 = 64 << 20;

/// The whole content of a file. Gzip is recognised by its first bytes, whatever the file's name; its content is held to
/// `limit` too, and to [`MAX_GZIP_RATIO`]. `expected` says in messages what kind of file it should be.
pub fn read(path: &Path, limit: Limit, expected: &str) -> Result<Vec<u8>, FormatError> {
    let fault = |source: io::Error| FormatError::Read {
        file: path.display().to_string(),
        source: match source.kind() {
            ErrorKind::NotFound => {
                let found = format!("expected {expected}, found no file of that name");
                io::Error::new(ErrorKind::NotFound, found)
            }
            ErrorKind::IsADirectory => {
                let found = format!("expected {expected}, found a folder{}", scene_in(path));
                io::Error::new(ErrorKind::IsADirectory, found)
            }
            _ => source,
        },
    };
    let stored = bounded::read(path, limit).map_err(fault)?;
    gunzip(stored, limit).map_err(fault)
}

/// A folder that was meant for the scene in it.
fn scene_in(folder: &Path) -> String {
    let scene = folder.join("scene.toml");
    if scene.is_file() {
        format!("; its scene is {}", scene.display())
    } else {
        String::new()
    }
}

/// Decompresses what begins as gzip does; gives back anything else as it is.
pub fn gunzip(stored: Vec<u8>, limit: Limit) -> io::Result<Vec<u8>> {
    if !stored.starts_with(GZIP) {
        return Ok(stored);
    }
    let swollen = (stored.len() as u64).saturating_mul(MAX_GZIP_RATIO);
    let swollen = Limit::fixed(swollen.max(GZIP_RATIO_FROM_BYTES));
    let limit = if limit.bytes <= swollen.bytes {
        limit
    } else {
        swollen
    };
    let mut bytes = Vec::new();
    MultiGzDecoder::new(&stored[..])
        .take(limit.bytes.saturating_add(1))
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit.bytes {
        return Err(limit.exceeded("the unpacked file"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn gzip_is_known_by_its_bytes_not_by_its_name() {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes) in [
            ("packed.can", gzip(b"text")),
            ("plain.can.gz", b"text".to_vec()),
            ("members.gz", [gzip(b"te"), gzip(b"xt")].concat()),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(read(&path, Limit::fixed(100), "text").unwrap(), b"text");
        }
    }

    #[test]
    fn files_that_cannot_be_read_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no.can");
        let said = |path: &Path| {
            let error = read(path, Limit::fixed(100), "text")
                .unwrap_err()
                .to_string();
            let file = format!("{}: cannot be read: ", path.display());
            error.strip_prefix(&file).unwrap().to_owned()
        };
        let expected = "expected text, found no file of that name";
        assert_eq!(said(&missing), expected);
        assert_eq!(said(folder.path()), "expected text, found a folder");
        let scene = folder.path().join("scene.toml");
        std::fs::write(&scene, "").unwrap();
        let expected = format!(
            "expected text, found a folder; its scene is {}",
            scene.display()
        );
        assert_eq!(said(folder.path()), expected);
    }

    #[test]
    fn truncated_and_garbled_gzip_is_refused() {
        let whole = gzip(b"p 1 100001001001 3 0 0 1 1 0 1 0 1 1\n");
        for end in 2..whole.len() {
            assert!(
                gunzip(whole[..end].to_vec(), Limit::fixed(1000)).is_err(),
                "{end}"
            );
        }
        let mut garbled = whole.clone();
        garbled[20] ^= 0x55;
        assert!(gunzip(garbled, Limit::fixed(1000)).is_err());
        assert!(gunzip([whole, b"rest".to_vec()].concat(), Limit::fixed(1000)).is_err());
    }

    #[test]
    fn what_is_too_large_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large");
        std::fs::write(&path, [b'x'; 101]).unwrap();
        let error = read(&path, Limit::fixed(100), "text")
            .unwrap_err()
            .to_string();
        assert!(
            error.ends_with("the file is larger than 100 bytes"),
            "{error}"
        );
        let error = gunzip(gzip(&[0; 1001]), Limit::fixed(1000))
            .unwrap_err()
            .to_string();
        assert_eq!(error, "the unpacked file is larger than 1000 bytes");
    }

    #[test]
    fn a_gzip_bomb_is_stopped_long_before_the_limit_of_the_file() {
        let bomb = gzip(&vec![b'\n'; 100 << 20]);
        assert!(bomb.len() < 600_000);
        let error = gunzip(bomb, Limit::fixed(MAX_GEOMETRY_BYTES))
            .unwrap_err()
            .to_string();
        assert_eq!(error, "the unpacked file is larger than 64.000 MiB");
    }
}
