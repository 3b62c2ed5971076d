//! Lines of blank-separated fields: what all formats but TOML are made of.

use std::fmt::Display;
use std::str;

use super::error::{FormatError, Place, excerpt};

/// A longer line is no line of any of these formats, but a file of another kind.
pub(super) const MAX_LINE_BYTES: usize = 1 << 20;

/// Lines with something in them: neither blank nor only a comment.
pub(super) struct Lines<'a> {
    file: &'a str,
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(file: &'a str, bytes: &'a [u8]) -> Self {
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self {
            file,
            rest,
            number: 0,
        }
    }

    /// The next line that says something; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<Fields<'a>>, FormatError> {
        while !self.rest.is_empty() {
            self.number += 1;
            let window = &self.rest[..self.rest.len().min(MAX_LINE_BYTES + 1)];
            let line = match window.iter().position(|&byte| byte == b'\n') {
                Some(end) => {
                    self.rest = &self.rest[end + 1..];
                    &window[..end]
                }
                None if window.len() > MAX_LINE_BYTES => {
                    return Err(FormatError::Content {
                        place: Place::line(self.file, self.number),
                        expected: format!("a line of at most {MAX_LINE_BYTES} bytes"),
                        found: format!("a longer one: {}", excerpt(window)),
                    });
                }
                None => {
                    self.rest = &[];
                    window
                }
            };
            let fields = Fields {
                file: self.file,
                line: self.number,
                rest: line,
            };
            if fields.clone().next().is_some() {
                return Ok(Some(fields));
            }
        }
        Ok(None)
    }

    /// The error for a file that ends, as a whole, without what it must have.
    pub(super) fn missing(&self, expected: impl Display) -> FormatError {
        FormatError::Content {
            place: Place::line(self.file, self.number.max(1)),
            expected: expected.to_string(),
            found: "the end of the file".to_owned(),
        }
    }
}

/// What is left of a line. A field that begins with `#` begins a comment.
#[derive(Clone)]
pub(super) struct Fields<'a> {
    file: &'a str,
    line: usize,
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub(super) fn line(&self) -> usize {
        self.line
    }

    pub(super) fn place(&self) -> Place {
        Place::line(self.file, self.line)
    }

    pub(super) fn next(&mut self) -> Option<&'a [u8]> {
        let start = self.rest.iter().position(|b| !b.is_ascii_whitespace())?;
        let rest = &self.rest[start..];
        if rest[0] == b'#' {
            self.rest = &[];
            return None;
        }
        let end = rest
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(rest.len());
        let (field, rest) = rest.split_at(end);
        self.rest = rest;
        Some(field)
    }

    /// A field that has to be there.
    pub(super) fn required(&mut self, expected: impl Display) -> Result<&'a [u8], FormatError> {
        let found = self.next();
        found.ok_or_else(|| self.fault(expected, None))
    }

    /// A finite number.
    pub(super) fn number(&mut self, what: impl Display) -> Result<f64, FormatError> {
        let field = self.next();
        let value = field
            .and_then(|field| str::from_utf8(field).ok()?.parse::<f64>().ok())
            .filter(|value| value.is_finite());
        value.ok_or_else(|| self.fault(format_args!("{what}, a finite number"), field))
    }

    /// A whole number, zero or more.
    pub(super) fn count(&mut self, what: impl Display) -> Result<usize, FormatError> {
        let field = self.next();
        let value = field.and_then(|field| str::from_utf8(field).ok()?.parse::<usize>().ok());
        value.ok_or_else(|| self.fault(format_args!("{what}, a whole number"), field))
    }

    /// Exactly this field.
    pub(super) fn keyword(&mut self, keyword: &str) -> Result<(), FormatError> {
        let field = self.next();
        if field == Some(keyword.as_bytes()) {
            return Ok(());
        }
        Err(self.fault(format_args!("'{keyword}'"), field))
    }

    /// Nothing more but a comment.
    pub(super) fn end(&mut self) -> Result<(), FormatError> {
        match self.next() {
            None => Ok(()),
            field => Err(self.fault("the end of the line", field)),
        }
    }

    /// The rest of the line as text, for names that may hold blanks.
    pub(super) fn text(&mut self) -> &'a [u8] {
        let text = self.rest.trim_ascii();
        self.rest = &[];
        text
    }

    /// The error for a field, or for the end of the line where a field should be.
    pub(super) fn fault(&self, expected: impl Display, found: Option<&[u8]>) -> FormatError {
        FormatError::Content {
            place: self.place(),
            expected: expected.to_string(),
            found: found.map_or_else(|| "the end of the line".to_owned(), excerpt),
        }
    }
}
