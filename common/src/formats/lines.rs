//! Lines of blank-separated fields: what all formats but TOML are made of.

use std::fmt::Display;
use std::str;

use super::error::{FormatError, Place, excerpt};

/// A longer line is no line of any of these formats, but a file of another kind.
pub(super) const MAX_LINE_BYTES: usize = 1 << 20;

/// Lines with something in them: neither blank nor only a comment. They end as on any system: with a line feed, a
/// carriage return, or both.
pub(super) struct Lines<'a> {
    file: &'a str,
    rest: &'a [u8],
    /// Of the line that was read last, or of its first part.
    number: usize,
    /// Of the line that comes next.
    next: usize,
    /// A backslash at its end joins a line to the next.
    joined: bool,
}

impl<'a> Lines<'a> {
    pub(super) fn new(file: &'a str, bytes: &'a [u8]) -> Self {
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        Self {
            file,
            rest,
            number: 0,
            next: 1,
            joined: false,
        }
    }

    /// Lines that a backslash at their end joins to the next, as in OBJ.
    pub(super) fn joined(file: &'a str, bytes: &'a [u8]) -> Self {
        Self {
            joined: true,
            ..Self::new(file, bytes)
        }
    }

    /// The next line that says something; `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<Fields<'a>>, FormatError> {
        while !self.rest.is_empty() {
            self.number = self.next;
            let fields = Fields {
                file: self.file,
                line: self.number,
                rest: self.line()?,
            };
            if fields.clone().next().is_some() {
                return Ok(Some(fields));
            }
        }
        Ok(None)
    }

    /// Takes a line off the rest.
    fn line(&mut self) -> Result<&'a [u8], FormatError> {
        let window = &self.rest[..self.rest.len().min(MAX_LINE_BYTES + 1)];
        let mut from = 0;
        loop {
            let end = window[from..].iter().position(|byte| is_line_end(*byte));
            let line = &window[..end.map_or(window.len(), |end| from + end)];
            // a path in a comment may end in a backslash
            let goes_on = self.joined && line.ends_with(b"\\") && !has_comment(&line[from..]);
            let after = &self.rest[line.len()..];
            from = line.len() + if after.starts_with(b"\r\n") { 2 } else { 1 };
            self.next += 1;
            let all = window.len() <= MAX_LINE_BYTES && from >= window.len();
            if all || end.is_some() && !goes_on {
                self.rest = self.rest.get(from..).unwrap_or_default();
                return Ok(if goes_on {
                    &line[..line.len() - 1]
                } else {
                    line
                });
            }
            if from >= window.len() {
                return Err(FormatError::Content {
                    place: Place::line(self.file, self.number),
                    expected: format!("a line of at most {MAX_LINE_BYTES} bytes"),
                    found: format!("a longer one: {}", excerpt(window)),
                });
            }
        }
    }

    /// The line that was read last.
    pub(super) fn place(&self) -> Place {
        Place::line(self.file, self.number.max(1))
    }

    /// The error for a file that ends, as a whole, without what it must have.
    pub(super) fn missing(&self, expected: impl Display) -> FormatError {
        FormatError::Content {
            place: self.place(),
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
        let mut rest = self.rest.trim_ascii_start();
        while is_joint(rest) {
            rest = rest[1..].trim_ascii_start();
        }
        if rest.is_empty() {
            self.rest = rest;
            return None;
        }
        if rest[0] == b'#' {
            self.rest = &[];
            return None;
        }
        let mut end = 0;
        while end < rest.len() && !is_blank(rest[end]) && !is_joint(&rest[end..]) {
            end += 1;
        }
        let (field, rest) = rest.split_at(end);
        self.rest = rest;
        Some(field)
    }

    /// The same in a name, in which a number may have a `#` before it: `leaf #2` is no `leaf`.
    pub(super) fn next_of_name(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest.trim_ascii_start();
        if !matches!(rest, [b'#', b'0'..=b'9', ..]) {
            return self.next();
        }
        let end = rest.iter().position(|byte| is_blank(*byte));
        let (field, rest) = rest.split_at(end.unwrap_or(rest.len()));
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

    /// The error for a field, or for the end of the line where a field should be.
    pub(super) fn fault(&self, expected: impl Display, found: Option<&[u8]>) -> FormatError {
        FormatError::Content {
            place: self.place(),
            expected: expected.to_string(),
            found: found.map_or_else(|| "the end of the line".to_owned(), excerpt),
        }
    }
}

fn is_line_end(byte: u8) -> bool {
    matches!(byte, b'\n' | b'\r')
}

fn is_blank(byte: u8) -> bool {
    byte.is_ascii_whitespace()
}

/// A backslash that joins a line to the next.
fn is_joint(bytes: &[u8]) -> bool {
    matches!(bytes, [b'\\', b'\n' | b'\r', ..])
}

/// Whether a field begins with `#`.
fn has_comment(line: &[u8]) -> bool {
    let begins = |at: usize| line[at] == b'#' && (at == 0 || is_blank(line[at - 1]));
    (0..line.len()).any(begins)
}
