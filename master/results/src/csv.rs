//! Tables as comma-separated text (RFC 4180, with plain line feeds).
//!
//! A number is the shortest text that reads back as the same f64, and always has a point or an
//! exponent, so that a column of zeros is still a column of floating-point numbers to a reader that
//! guesses types.

use std::io::{self, Write};

use crate::error::Fault;
use crate::table::{Cells, Table};

/// Writes the header and all rows.
pub(crate) fn write(table: &Table<'_>, out: &mut impl Write) -> Result<(), Fault> {
    for (position, column) in table.columns.iter().enumerate() {
        separate(position, out)?;
        write_text(column.name, out)?;
    }
    out.write_all(b"\n")?;

    let mut digits = zmij::Buffer::new();
    for row in 0..table.rows {
        for (position, column) in table.columns.iter().enumerate() {
            separate(position, out)?;
            match &column.cells {
                Cells::Text(cell) => write_text(cell(row), out)?,
                Cells::Index(cell) => write!(out, "{}", cell(row))?,
                Cells::Real(cell) => {
                    let value = column.finite(row, cell(row))?;
                    out.write_all(digits.format_finite(value).as_bytes())?;
                }
                Cells::Sparse(cell) => {
                    if let Some(value) = cell(row) {
                        let value = column.finite(row, value)?;
                        out.write_all(digits.format_finite(value).as_bytes())?;
                    }
                }
            }
        }
        out.write_all(b"\n")?;
    }
    Ok(())
}

fn separate(position: usize, out: &mut impl Write) -> io::Result<()> {
    if position > 0 {
        out.write_all(b",")?;
    }
    Ok(())
}

/// Text in quotes where it holds a quote, a comma or a line break; quotes inside are doubled.
fn write_text(text: &str, out: &mut impl Write) -> io::Result<()> {
    if !text.contains(['"', ',', '\n', '\r']) {
        return out.write_all(text.as_bytes());
    }
    out.write_all(b"\"")?;
    out.write_all(text.replace('"', "\"\"").as_bytes())?;
    out.write_all(b"\"")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Column;
    use proptest::prelude::*;

    fn text_of(table: &Table<'_>) -> Result<String, Fault> {
        let mut out = Vec::new();
        write(table, &mut out)?;
        Ok(String::from_utf8_lossy(&out).into_owned())
    }

    fn one_column<'a>(rows: usize, column: Column<'a>) -> Table<'a> {
        Table {
            name: "test",
            rows,
            columns: vec![column],
        }
    }

    #[test]
    fn quotes_only_where_needed() {
        let names = [
            "plain",
            "a,b",
            "say \"so\"",
            "two\nlines",
            "cr\r",
            " space ",
            "",
            "é",
        ];
        let table = one_column(names.len(), Column::text("organ", |row| names[row]));
        assert_eq!(
            text_of(&table).expect("written"),
            "organ\nplain\n\"a,b\"\n\"say \"\"so\"\"\"\n\"two\nlines\"\n\"cr\r\"\n space \n\né\n"
        );
    }

    #[test]
    fn numbers_are_short_and_typed() {
        let values = [
            0.0,
            -0.0,
            1.0,
            0.1 + 0.2,
            1.234_567_890_12,
            1e-11,
            2.5e22,
            -7.0,
        ];
        let table = one_column(values.len(), Column::quantity("x", |row| values[row]));
        assert_eq!(
            text_of(&table).expect("written"),
            "x\n0.0\n0.0\n1.0\n0.3\n1.23456789\n1e-11\n2.5e+22\n-7.0\n"
        );
    }

    #[test]
    fn infinities_are_refused() {
        let table = one_column(
            3,
            Column::quantity("absorbed_W", |row| 1.0 / (2.0 - row as f64)),
        );
        let error = text_of(&table).expect_err("refused").to_string();
        assert_eq!(error, "absorbed_W in row 2 is inf, not a finite number");
    }

    proptest! {
        #[test]
        fn what_is_written_reads_back(value in proptest::num::f64::NORMAL) {
            let column = Column { name: "x", cells: Cells::Real(std::rc::Rc::new(move |_| value)) };
            let text = text_of(&one_column(1, column)).expect("written");
            let read: f64 = text.lines().nth(1).expect("a row").parse().expect("a number");
            prop_assert_eq!(read.to_bits(), value.to_bits());
        }
    }
}
