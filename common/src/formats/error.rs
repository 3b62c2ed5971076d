//! What is said of a file that cannot be used.

use std::fmt;
use std::io;

use thiserror::Error;

/// A file, and the line in it where that is known.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    /// The file as the user named it.
    pub file: String,
    /// Counted from 1.
    pub line: Option<usize>,
}

impl Place {
    /// A line of a file.
    pub fn line(file: &str, line: usize) -> Self {
        Self {
            file: file.to_owned(),
            line: Some(line),
        }
    }

    /// A file as a whole.
    pub fn file(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            line: None,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}, line {line}", self.file),
            None => f.write_str(&self.file),
        }
    }
}

/// Why a file was refused.
#[derive(Debug, Error)]
pub enum FormatError {
    /// The operating system or the decompressor refused.
    #[error("{file}: cannot be read: {source}")]
    Read {
        /// The file as the user named it.
        file: String,
        /// What they said.
        source: io::Error,
    },
    /// The content is not what the format asks for.
    #[error("{place}: expected {expected}, found {found}")]
    Content {
        /// Where.
        place: Place,
        /// What the format asks for there.
        expected: String,
        /// What stands there, shortened and made printable.
        found: String,
    },
    /// A scene file that is no TOML, or says what cannot be.
    #[error("{place}: {message}")]
    Scene {
        /// Where.
        place: Place,
        /// What is wrong, in the words of the TOML parser or of what was refused.
        message: String,
    },
}

impl FormatError {
    /// The file, and the line where there is one.
    pub fn place(&self) -> Place {
        match self {
            Self::Read { file, .. } => Place::file(file),
            Self::Content { place, .. } | Self::Scene { place, .. } => place.clone(),
        }
    }
}

/// Bytes of a file as they can be shown in a message: printable, and short.
pub(super) fn excerpt(bytes: &[u8]) -> String {
    const SHOWN: usize = 40;
    let cut = &bytes[..bytes.len().min(SHOWN)];
    let more = if bytes.len() > SHOWN { "..." } else { "" };
    let printable: String = String::from_utf8_lossy(cut)
        .chars()
        .flat_map(char::escape_debug)
        .collect();
    format!("'{printable}{more}'")
}
