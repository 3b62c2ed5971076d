//! Records of comma-separated text: RFC 4180, as [`crate::csv`] writes it, with line ends of any system. They are read
//! one by one, so that a table takes no memory of its own.

use std::borrow::Cow;
use std::io::{self, BufRead, ErrorKind};

/// A longer record is no row of a table.
const MAX_RECORD_BYTES: usize = 1 << 20;

/// The records of a text, one after the other.
#[derive(Debug)]
pub(super) struct Records<R> {
    text: R,
    /// The record that was read last, without its line end.
    record: Vec<u8>,
    /// It ended with a carriage return, to which a line feed may belong.
    ended_by_return: bool,
}

/// Where in a record one is.
#[derive(Clone, Copy, PartialEq)]
enum Within {
    /// At the beginning of a cell.
    Begin,
    /// In a cell without quotes, or after the quotes.
    Plain,
    Quotes,
    /// After a quote in quotes: at their end, or before another one.
    Quote,
}

impl<R: BufRead> Records<R> {
    pub(super) fn new(text: R) -> Self {
        Self {
            text,
            record: Vec::new(),
            ended_by_return: false,
        }
    }

    /// The next record; none at the end of the text.
    pub(super) fn next(&mut self) -> io::Result<Option<&str>> {
        self.record.clear();
        let mut within = Within::Begin;
        let mut is_there = false;
        loop {
            let part = self.text.fill_buf()?;
            if part.is_empty() {
                break;
            }
            if std::mem::take(&mut self.ended_by_return) && part[0] == b'\n' {
                self.text.consume(1);
                continue;
            }
            is_there = true;
            let mut end = None;
            for (at, &byte) in part.iter().enumerate() {
                within = match (within, byte) {
                    (Within::Quotes, b'"') => Within::Quote,
                    (Within::Quotes, _) | (Within::Begin | Within::Quote, b'"') => Within::Quotes,
                    (_, b'\n' | b'\r') => {
                        end = Some(at);
                        break;
                    }
                    (_, b',') => Within::Begin,
                    _ => Within::Plain,
                };
            }
            let own = &part[..end.unwrap_or(part.len())];
            if self.record.len() + own.len() > MAX_RECORD_BYTES {
                let message = format!("a row is longer than {MAX_RECORD_BYTES} bytes");
                return Err(io::Error::new(ErrorKind::InvalidData, message));
            }
            self.record.extend_from_slice(own);
            self.ended_by_return = end.is_some_and(|end| part[end] == b'\r');
            let taken = end.map_or(part.len(), |end| end + 1);
            self.text.consume(taken);
            if end.is_some() {
                break;
            }
        }
        if !is_there {
            return Ok(None);
        }
        let text = std::str::from_utf8(&self.record);
        text.map(Some)
            .map_err(|error| io::Error::new(ErrorKind::InvalidData, error))
    }
}

/// The cells of a record.
pub(super) fn cells<'a>(mut rest: &'a str, cells: &mut Vec<Cow<'a, str>>) {
    cells.clear();
    loop {
        let (cell, after) = match rest.strip_prefix('"') {
            Some(quoted) => in_quotes(quoted),
            None => {
                let end = rest.find(',').unwrap_or(rest.len());
                (rest[..end].into(), &rest[end..])
            }
        };
        cells.push(cell);
        match after.strip_prefix(',') {
            Some(next) => rest = next,
            None => return,
        }
    }
}

/// The text up to the closing quote, and what comes after it.
fn in_quotes(text: &str) -> (Cow<'_, str>, &str) {
    let mut from = 0;
    loop {
        let Some(at) = text[from..].find('"').map(|at| from + at) else {
            return (text.replace("\"\"", "\"").into(), "");
        };
        if !text[at + 1..].starts_with('"') {
            return (text[..at].replace("\"\"", "\"").into(), &text[at + 1..]);
        }
        from = at + 2;
    }
}

#[cfg(test)]
mod tests {
    use std::io::{BufReader, Read};

    use super::*;

    fn all(text: impl Read, buffer: usize) -> Vec<Vec<String>> {
        let mut records = Records::new(BufReader::with_capacity(buffer, text));
        let mut all = Vec::new();
        while let Some(record) = records.next().unwrap() {
            let mut found = Vec::new();
            cells(record, &mut found);
            all.push(found.into_iter().map(Cow::into_owned).collect());
        }
        all
    }

    #[test]
    fn quoted_names_come_back() {
        let text = "plain,\"a,b\",\"say \"\"so\"\"\",\"two\nlines\",,é\nnext";
        let expected = [
            vec!["plain", "a,b", "say \"so\"", "two\nlines", "", "é"],
            vec!["next"],
        ];
        for buffer in 1..20 {
            assert_eq!(all(text.as_bytes(), buffer), expected);
        }
    }

    #[test]
    fn a_lone_carriage_return_ends_a_row() {
        let expected = [
            vec!["a", "b"],
            vec!["", "2"],
            vec!["\r"],
            vec![""],
            vec!["3"],
        ];
        let text = "a,b\n,2\n\"\r\"\n\n3\n";
        for end in ["\n", "\r", "\r\n"] {
            let text = text.replace('\n', end);
            for buffer in 1..8 {
                assert_eq!(all(text.as_bytes(), buffer), expected, "{end:?}");
            }
        }
    }

    #[test]
    fn a_row_without_end_is_refused() {
        let mut records = Records::new(BufReader::new(io::repeat(0)));
        let error = records.next().unwrap_err();
        assert_eq!(error.to_string(), "a row is longer than 1048576 bytes");
        // and what is no text
        let mut records = Records::new(&b"a,\xff\n"[..]);
        assert!(records.next().is_err());
    }
}
