//! Files to bytes: the only place where a format touches the file system.

use std::fs::File;
use std::io::{self, Read};
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
/// whatever the file's name; its content is held to `limit` too, and to [`MAX_GZIP_RATIO`].
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>, FormatError> {
    let fault = |source| FormatError::Read {
        file: path.display().to_string(),
        source,
    };
    let file = File::open(path).map_err(fault)?;
    let stored = up_to(file, limit, "the file").map_err(fault)?;
    gunzip(stored, limit).map_err(fault)
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
            io::ErrorKind::FileTooLarge,
            format!("{what} is larger than {limit} bytes"),
        ));
    }
    Ok(bytes)
}
