//! Files to bytes: the only place where a format touches the file system.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use flate2::read::MultiGzDecoder;

use super::error::FormatError;

/// Geometry files, before and after decompression: 8 GiB is about 70 million triangles of text.
pub const MAX_GEOMETRY_BYTES: u64 = 8 << 30;

/// All other files are written by hand or hold a few numbers.
pub const MAX_SMALL_BYTES: u64 = 16 << 20;

/// Text of coordinates shrinks 5 to 10 times; a file that swells more than this is a bomb.
pub const MAX_GZIP_RATIO: u64 = 100;

/// Below this size the ratio is not looked at: little files of zeros are harmless.
const GZIP_RATIO_FROM_BYTES: u64 = 64 << 20;

/// The whole content of a file of at most `limit` bytes. Gzip is recognised by its first bytes,
/// whatever the file's name; its content is held to `limit` too, and to [`MAX_GZIP_RATIO`]. `expected` says in messages
/// what kind of file it should be.
pub fn read(path: &Path, limit: u64, expected: &str) -> Result<Vec<u8>, FormatError> {
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
    let file = File::open(path).map_err(fault)?;
    if file.metadata().map_err(fault)?.is_dir() {
        return Err(fault(ErrorKind::IsADirectory.into()));
    }
    let stored = up_to(file, limit, "the file").map_err(fault)?;
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
pub fn gunzip(stored: Vec<u8>, limit: u64) -> io::Result<Vec<u8>> {
    if !stored.starts_with(&[0x1f, 0x8b]) {
        return Ok(stored);
    }
    let swollen = (stored.len() as u64).saturating_mul(MAX_GZIP_RATIO);
    let limit = limit.min(swollen.max(GZIP_RATIO_FROM_BYTES));
    up_to(MultiGzDecoder::new(&stored[..]), limit, "the unpacked file")
}

fn up_to(source: impl Read, limit: u64, what: &str) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source
        .take(limit.saturating_add(1))
        .read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(io::Error::new(
            ErrorKind::FileTooLarge,
            format!("{what} is larger than {limit} bytes"),
        ));
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
            assert_eq!(read(&path, 100, "text").unwrap(), b"text");
        }
    }

    #[test]
    fn files_that_cannot_be_read_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("no.can");
        let said = |path: &Path| {
            let error = read(path, 100, "text").unwrap_err().to_string();
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
            assert!(gunzip(whole[..end].to_vec(), 1000).is_err(), "{end}");
        }
        let mut garbled = whole.clone();
        garbled[20] ^= 0x55;
        assert!(gunzip(garbled, 1000).is_err());
        assert!(gunzip([whole, b"rest".to_vec()].concat(), 1000).is_err());
    }

    #[test]
    fn what_is_too_large_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large");
        std::fs::write(&path, [b'x'; 101]).unwrap();
        let error = read(&path, 100, "text").unwrap_err().to_string();
        assert!(
            error.ends_with("the file is larger than 100 bytes"),
            "{error}"
        );
        let error = gunzip(gzip(&[0; 1001]), 1000).unwrap_err().to_string();
        assert_eq!(error, "the unpacked file is larger than 1000 bytes");
    }

    #[test]
    fn a_gzip_bomb_is_stopped_long_before_the_limit_of_the_file() {
        let bomb = gzip(&vec![b'\n'; 100 << 20]);
        assert!(bomb.len() < 600_000);
        let error = gunzip(bomb, MAX_GEOMETRY_BYTES).unwrap_err().to_string();
        assert_eq!(error, "the unpacked file is larger than 67108864 bytes");
    }
}
