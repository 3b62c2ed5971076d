//! CSV tables as `nestrad solve` writes them, read back row by row.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use super::error::ReportError;

/// A table in memory.
#[derive(Debug)]
pub(crate) struct Table {
    path: PathBuf,
    text: String,
}

/// A row, of which cells are asked for by number.
#[derive(Debug)]
pub(crate) struct Row<'a> {
    path: &'a Path,
    /// Counted from 1, the header being 1.
    number: usize,
    cells: Vec<Cow<'a, str>>,
    columns: &'a [&'a str],
}

impl Table {
    pub(crate) fn read(path: PathBuf) -> Result<Self, ReportError> {
        match fs::read_to_string(&path) {
            Ok(text) => Ok(Self { path, text }),
            Err(source) => Err(ReportError::Read { path, source }),
        }
    }

    /// Calls `each` for all rows but the header, which must begin with `columns`.
    pub(crate) fn rows(
        &self,
        columns: &[&str],
        mut each: impl FnMut(&Row<'_>) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        let mut rest = self.text.as_str();
        let mut row = Row {
            path: &self.path,
            number: 1,
            cells: Vec::new(),
            columns,
        };
        record(&mut rest, &mut row.cells);
        if row.cells.len() < columns.len() || row.cells.iter().zip(columns).any(|(a, b)| a != b) {
            return Err(row.not(&columns.join(","), &row.cells.join(",")));
        }
        while !rest.is_empty() {
            row.number += 1;
            record(&mut rest, &mut row.cells);
            if row.cells.len() < columns.len() {
                let cells = row.cells.len().to_string();
                return Err(row.not(&format!("{} cells", columns.len()), &cells));
            }
            each(&row)?;
        }
        Ok(())
    }

    /// The error of a table that does not have a row for all that there are.
    pub(crate) fn is_cut_off(&self, rows: usize) -> ReportError {
        ReportError::Table {
            path: self.path.clone(),
            row: rows + 2,
            expected: "a row for every band".to_owned(),
            found: "the end of the table".to_owned(),
        }
    }
}

impl Row<'_> {
    pub(crate) fn text(&self, column: usize) -> &str {
        &self.cells[column]
    }

    pub(crate) fn real(&self, column: usize) -> Result<f64, ReportError> {
        let text = self.text(column);
        let value = text.parse().ok().filter(|value: &f64| value.is_finite());
        let name = self.columns[column];
        value.ok_or_else(|| self.not(&format!("a number for {name}"), text))
    }

    pub(crate) fn index(&self, column: usize) -> Result<usize, ReportError> {
        let (text, name) = (self.text(column), self.columns[column]);
        let value = text.parse().ok();
        value.ok_or_else(|| self.not(&format!("a whole number for {name}"), text))
    }

    /// Refuses the row unless a cell is what is expected.
    pub(crate) fn must_be(&self, column: usize, expected: &str) -> Result<(), ReportError> {
        if self.text(column) == expected {
            return Ok(());
        }
        let what = format!("{} {expected}", self.columns[column]);
        Err(self.not(&what, self.text(column)))
    }

    /// The error of a row that is not what it should be.
    pub(crate) fn not(&self, expected: &str, found: &str) -> ReportError {
        ReportError::Table {
            path: self.path.to_owned(),
            row: self.number,
            expected: expected.to_owned(),
            found: found.to_owned(),
        }
    }
}

/// Takes one record off the text: RFC 4180, as [`crate::csv`] writes it.
fn record<'a>(rest: &mut &'a str, cells: &mut Vec<Cow<'a, str>>) {
    cells.clear();
    loop {
        let (cell, after) = match rest.strip_prefix('"') {
            Some(quoted) => in_quotes(quoted),
            None => {
                let end = rest.find([',', '\n']).unwrap_or(rest.len());
                (rest[..end].trim_end_matches('\r').into(), &rest[end..])
            }
        };
        cells.push(cell);
        let more = after.starts_with(',');
        *rest = after.get(1..).unwrap_or("");
        if !more {
            return;
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
            let after = text[at + 1..].trim_start_matches('\r');
            return (text[..at].replace("\"\"", "\"").into(), after);
        }
        from = at + 2;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        Table {
            path: "t.csv".into(),
            text: text.to_owned(),
        }
    }

    #[test]
    fn quoted_names_come_back() {
        let mut rest = "plain,\"a,b\",\"say \"\"so\"\"\",\"two\nlines\",,é\nnext";
        let mut cells = Vec::new();
        record(&mut rest, &mut cells);
        assert_eq!(cells, ["plain", "a,b", "say \"so\"", "two\nlines", "", "é"]);
        assert_eq!(rest, "next");
    }

    #[test]
    fn rows_are_counted_in_errors() {
        let table = table("band,x\nPAR,1.5\nPAR,much\n");
        let mut sum = 0.0;
        let error = table.rows(&["band", "x"], |row| {
            sum += row.real(1)?;
            Ok(())
        });
        assert_eq!(sum, 1.5);
        assert_eq!(
            error.expect_err("refused").to_string(),
            "t.csv, row 3: expected a number for x, found much"
        );
    }

    #[test]
    fn another_table_is_refused() {
        let error = table("a,b\n").rows(&["band"], |_| Ok(()));
        assert!(error.is_err());
        let error = table("band,x\nPAR\n").rows(&["band", "x"], |_| Ok(()));
        assert!(error.is_err());
    }
}
