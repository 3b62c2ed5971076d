//! Bearer tokens: secrets that are compared in constant time and never shown.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use nestrad_common::bounded::{self, Limit};
use subtle::ConstantTimeEq;
use thiserror::Error;
use tonic::metadata::{Ascii, MetadataValue};

/// The environment variable that a client or worker takes its token from where no file is named.
pub const TOKEN_VARIABLE: &str = "NESTRAD_TOKEN";

/// Shorter tokens can be guessed; longer ones do not fit a header.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=4096;

/// Certificates, keys and tokens are no larger than this.
const LIMIT: Limit = Limit::fixed(1 << 20);

/// A secret that says who may use which service.
#[derive(Clone)]
pub struct Token(String);

impl Token {
    /// A token as written down; blanks and line ends around it do not count.
    pub fn new(text: &str) -> Result<Self, TokenFault> {
        let text = text.trim();
        let proper = LENGTHS.contains(&text.len()) && text.bytes().all(|b| b.is_ascii_graphic());
        proper.then(|| Self(text.to_owned())).ok_or(TokenFault)
    }

    /// Reads a token from a file.
    pub fn read(path: &Path) -> Result<Self, TokenError> {
        let bytes = read_small(path).map_err(|source| TokenError::Read {
            path: path.to_owned(),
            source,
        })?;
        let text = String::from_utf8_lossy(&bytes);
        Self::new(&text).map_err(|fault| TokenError::Content {
            place: path.display().to_string(),
            fault,
        })
    }

    /// The token of [`TOKEN_VARIABLE`], if it is set.
    pub fn from_environment() -> Result<Option<Self>, TokenError> {
        let Ok(text) = std::env::var(TOKEN_VARIABLE) else {
            return Ok(None);
        };
        let token = Self::new(&text).map_err(|fault| TokenError::Content {
            place: TOKEN_VARIABLE.to_owned(),
            fault,
        })?;
        Ok(Some(token))
    }

    /// Whether the header `authorization` holds this token. The time it takes does not depend on how
    /// much of it is right.
    pub fn is_in(&self, header: &[u8]) -> bool {
        let given = header
            .strip_prefix(b"Bearer ")
            .or_else(|| header.strip_prefix(b"bearer "));
        given.is_some_and(|given| bool::from(given.ct_eq(self.0.as_bytes())))
    }

    /// Whether it is the same as another.
    pub(crate) fn is_same_as(&self, other: &Self) -> bool {
        bool::from(self.0.as_bytes().ct_eq(other.0.as_bytes()))
    }

    /// The value of the header `authorization`, which is kept out of logs.
    pub(crate) fn header(&self) -> Result<MetadataValue<Ascii>, TokenFault> {
        let mut value: MetadataValue<Ascii> = format!("Bearer {}", self.0)
            .parse()
            .map_err(|_| TokenFault)?;
        value.set_sensitive(true);
        Ok(value)
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(..)")
    }
}

/// The content of a file that holds a certificate, a key or a token.
pub(crate) fn read_small(path: &Path) -> io::Result<Vec<u8>> {
    bounded::read(path, LIMIT)
}

/// Not a token. What was found is not said.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("expected a token of 16 to 4096 visible ASCII characters")]
pub struct TokenFault;

/// Why there is no token.
#[derive(Debug, Error)]
pub enum TokenError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// What is there is no token.
    #[error("{place}: {fault}")]
    Content {
        /// The file or the variable.
        place: String,
        /// What was expected.
        fault: TokenFault,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_found_in_its_header_only() {
        let token = Token::new(" 0123456789abcdef\n").unwrap();
        assert!(token.is_in(b"Bearer 0123456789abcdef"));
        assert!(token.is_in(token.header().unwrap().as_bytes()));
        for other in [
            &b""[..],
            b"Bearer ",
            b"Bearer 0123456789abcde",
            b"Bearer 0123456789abcdef0",
            b"Bearer 0123456789abcdeF",
            b"Basic 0123456789abcdef",
            b"0123456789abcdef",
        ] {
            assert!(!token.is_in(other));
        }
    }

    #[test]
    fn what_is_no_token_is_refused_and_not_repeated() {
        for text in ["", "short", "0123456789 abcdef", "0123456789abcdef\u{e9}"] {
            let fault = Token::new(text).unwrap_err().to_string();
            assert!(text.is_empty() || !fault.contains(text));
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        assert!(matches!(Token::read(&path), Err(TokenError::Read { .. })));
        std::fs::write(&path, "secret word").unwrap();
        let error = Token::read(&path).unwrap_err().to_string();
        assert!(error.contains("token: expected") && !error.contains("secret"));
        std::fs::write(&path, "0123456789abcdef\n").unwrap();
        let token = Token::read(&path).unwrap();
        assert_eq!(format!("{token:?}"), "Token(..)");
    }
}
