//! What is said to the user: results on stdout, notes and errors on stderr.

use std::io::{self, ErrorKind, Write};

use anyhow::{Context, Result};
use nestrad_common::printable;

/// Writes to stdout. A reader that has seen enough (`nestrad check ... | head`) is no error.
pub(crate) fn print(text: &[u8]) -> Result<()> {
    let text = String::from_utf8_lossy(text);
    let mut out = io::stdout().lock();
    let written = out.write_all(printable::lines(&text).as_bytes());
    match written.and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(error).context("cannot write to stdout")
        }
        _ => Ok(()),
    }
}

/// Remarks on stderr while a command runs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Notes {
    pub(crate) quiet: bool,
}

impl Notes {
    /// Shows a table of results that are written already: a stdout that takes nothing does not undo them.
    pub(crate) fn show(self, table: &[u8]) {
        if let Err(error) = print(table) {
            self.say("warning", &format!("{error:#}: the table is not shown"));
        }
    }

    pub(crate) fn say(self, what: &str, line: &str) {
        if !self.quiet {
            note(what, line);
        }
    }
}

/// A remark or an error. Whatever comes from a file or a peer is cleaned here.
pub(super) fn note(what: &str, text: &str) {
    let text = printable::line(text);
    // nothing can be done about a stderr that is gone
    let _ = writeln!(io::stderr().lock(), "{what}: {text}");
}

/// An error and its causes in one line. Where a message says what its cause says too, it is said once.
pub(super) fn chain(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        if text.is_empty() {
            text = cause;
        } else if !text.ends_with(&cause) {
            text.push_str(": ");
            text.push_str(&cause);
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::anyhow;

    #[test]
    fn causes_are_said_once() {
        let plain = anyhow!("disk full").context("cannot write out/organs.csv");
        assert_eq!(chain(&plain), "cannot write out/organs.csv: disk full");
        let said = anyhow!("no such file").context("a.can: cannot be read: no such file");
        assert_eq!(chain(&said), "a.can: cannot be read: no such file");
    }
}
