//! Tables as `nestrad solve` writes them, CSV or Parquet, read back row by row. Columns are found by their
//! names: those that nobody asks for may stand anywhere.

use std::borrow::Cow;
use std::fs::File;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use nestrad_common::bounded;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use parquet::schema::types::Type;

use super::error::ReportError;
use super::record::{Records, cells};

/// A table that is there.
#[derive(Debug)]
pub(crate) struct Table {
    path: PathBuf,
    /// In their order in the file.
    columns: Vec<String>,
    content: Content,
}

enum Content {
    /// After the header.
    Csv(Records<BufReader<File>>),
    Parquet(SerializedFileReader<File>),
}

/// A row, of which cells are asked for by the place of their column in the list that was asked for.
#[derive(Debug)]
pub(crate) struct Row<'a> {
    path: &'a Path,
    /// Counted from 1, the header being 1.
    number: usize,
    cells: Vec<Cell<'a>>,
    columns: &'a [&'a str],
}

#[derive(Clone, Debug)]
enum Cell<'a> {
    Text(Cow<'a, str>),
    Real(f64),
    Index(i64),
}

impl Table {
    /// Opens `NAME.csv` or `NAME.parquet`, whichever the folder has; `None` where it has neither.
    pub(crate) fn find(folder: &Path, name: &str) -> Result<Option<Self>, ReportError> {
        for (ending, open) in [
            ("csv", Self::open_csv as fn(PathBuf) -> _),
            ("parquet", Self::open_parquet),
        ] {
            let path = folder.join(name).with_extension(ending);
            if path.exists() {
                return open(path).map(Some);
            }
        }
        Ok(None)
    }

    /// As [`Table::find`]; a table that is not there is an error.
    pub(crate) fn open(folder: &Path, name: &str) -> Result<Self, ReportError> {
        let missing = || ReportError::NoTable {
            folder: folder.to_owned(),
            name: name.to_owned(),
        };
        Self::find(folder, name)?.ok_or_else(missing)
    }

    fn open_csv(path: PathBuf) -> Result<Self, ReportError> {
        let read = || {
            let file = bounded::open(&path)?;
            let mut records = Records::new(BufReader::with_capacity(1 << 16, file));
            let mut header = Vec::new();
            cells(records.next()?.unwrap_or_default(), &mut header);
            let columns = header.into_iter().map(Cow::into_owned).collect();
            Ok((columns, records))
        };
        match read() {
            Ok((columns, records)) => Ok(Self {
                path,
                columns,
                content: Content::Csv(records),
            }),
            Err(source) => Err(ReportError::Read { path, source }),
        }
    }

    fn open_parquet(path: PathBuf) -> Result<Self, ReportError> {
        let file = match bounded::open(&path) {
            Ok(file) => file,
            Err(source) => return Err(ReportError::Read { path, source }),
        };
        let reader = match guarded(|| SerializedFileReader::new(file)) {
            Ok(reader) => reader,
            Err(source) => return Err(ReportError::Parquet { path, source }),
        };
        let schema = reader.metadata().file_metadata().schema();
        let names = schema.get_fields().iter().map(|f| f.name().to_owned());
        Ok(Self {
            path,
            columns: names.collect(),
            content: Content::Parquet(reader),
        })
    }

    /// Calls `each` for all rows, with the cells of these columns. To be called once.
    pub(crate) fn rows(
        &mut self,
        columns: &[&str],
        mut each: impl FnMut(&Row<'_>) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        let place = |name: &&str| self.columns.iter().position(|own| own == name);
        let places: Option<Vec<usize>> = columns.iter().map(place).collect();
        let path = &self.path;
        let Some(places) = places else {
            let wanted = format!("the columns {}", columns.join(","));
            let row = Row::new(path, columns, 1, Vec::new());
            return Err(row.not(&wanted, &self.columns.join(",")));
        };
        let mut number = 1;
        match &mut self.content {
            Content::Csv(records) => {
                let read = |source| ReportError::Read {
                    path: path.clone(),
                    source,
                };
                while let Some(record) = records.next().map_err(read)? {
                    number += 1;
                    let mut all = Vec::with_capacity(self.columns.len());
                    cells(record, &mut all);
                    if all.len() != self.columns.len() {
                        let wanted = format!("{} cells", self.columns.len());
                        let found = all.len().to_string();
                        let row = Row::new(path, columns, number, Vec::new());
                        return Err(row.not(&wanted, &found));
                    }
                    let wanted = places.iter().map(|&place| Cell::Text(all[place].clone()));
                    each(&Row::new(path, columns, number, wanted.collect()))?;
                }
            }
            Content::Parquet(reader) => {
                let broken = |source| ReportError::Parquet {
                    path: path.clone(),
                    source,
                };
                let mut rows = guarded(|| parquet_rows(reader, columns)).map_err(broken)?;
                while let Some(cells) = guarded(|| rows.next().transpose()).map_err(broken)? {
                    number += 1;
                    each(&Row::new(path, columns, number, cells))?;
                }
            }
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

/// Reads of a Parquet file, which may be damaged: the library has checks that panic.
fn guarded<T>(read: impl FnOnce() -> Result<T, ParquetError>) -> Result<T, ParquetError> {
    catch_unwind(AssertUnwindSafe(read))
        .unwrap_or_else(|_| Err(ParquetError::General("the file is damaged".to_owned())))
}

/// The cells of these columns, which the file has, row by row.
fn parquet_rows<'a>(
    reader: &'a SerializedFileReader<File>,
    columns: &'a [&'a str],
) -> Result<impl Iterator<Item = Result<Vec<Cell<'a>>, ParquetError>>, ParquetError> {
    let schema = reader.metadata().file_metadata().schema();
    let wanted = schema.get_fields().iter();
    let wanted: Vec<_> = wanted
        .filter(|field| columns.contains(&field.name()))
        .cloned()
        .collect();
    let place = |name: &&str| wanted.iter().position(|field| field.name() == *name);
    let places: Vec<usize> = columns.iter().filter_map(place).collect();
    let projection = Type::group_type_builder(schema.name())
        .with_fields(wanted)
        .build()?;
    let rows = reader.get_row_iter(Some(projection))?;
    Ok(rows.map(move |row| {
        let fields: Vec<Field> = row?.into_columns().into_iter().map(|(_, f)| f).collect();
        Ok(places.iter().map(|&place| cell(&fields[place])).collect())
    }))
}

fn cell(field: &Field) -> Cell<'static> {
    match field {
        Field::Str(text) => Cell::Text(text.clone().into()),
        Field::Double(value) => Cell::Real(*value),
        Field::Long(value) => Cell::Index(*value),
        other => Cell::Text(other.to_string().into()),
    }
}

impl<'a> Row<'a> {
    fn new(path: &'a Path, columns: &'a [&'a str], number: usize, cells: Vec<Cell<'a>>) -> Self {
        Self {
            path,
            number,
            cells,
            columns,
        }
    }
}

impl Row<'_> {
    pub(crate) fn text(&self, column: usize) -> Cow<'_, str> {
        match &self.cells[column] {
            Cell::Text(text) => Cow::Borrowed(text),
            Cell::Real(value) => value.to_string().into(),
            Cell::Index(value) => value.to_string().into(),
        }
    }

    pub(crate) fn real(&self, column: usize) -> Result<f64, ReportError> {
        let value = match &self.cells[column] {
            Cell::Text(text) => text.parse().ok(),
            Cell::Real(value) => Some(*value),
            Cell::Index(_) => None,
        };
        let value = value.filter(|value: &f64| value.is_finite());
        let name = self.columns[column];
        value.ok_or_else(|| self.not(&format!("a number for {name}"), &self.text(column)))
    }

    pub(crate) fn index(&self, column: usize) -> Result<usize, ReportError> {
        let value = match &self.cells[column] {
            Cell::Text(text) => text.parse().ok(),
            Cell::Real(_) => None,
            Cell::Index(value) => usize::try_from(*value).ok(),
        };
        let name = self.columns[column];
        value.ok_or_else(|| self.not(&format!("a whole number for {name}"), &self.text(column)))
    }

    /// Refuses the row unless a cell is what is expected.
    pub(crate) fn must_be(&self, column: usize, expected: &str) -> Result<(), ReportError> {
        if self.text(column) == expected {
            return Ok(());
        }
        let what = format!("{} {expected}", self.columns[column]);
        Err(self.not(&what, &self.text(column)))
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

impl std::fmt::Debug for Content {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Csv(_) => "Csv",
            Self::Parquet(_) => "Parquet",
        })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::table::{self, Column};

    fn rows(
        text: &str,
        columns: &[&str],
        each: impl FnMut(&Row<'_>) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("t.csv"), text).expect("written");
        Table::open(folder.path(), "t")?.rows(columns, each)
    }

    #[test]
    fn rows_are_counted_in_errors() {
        let mut sum = 0.0;
        let error = rows("band,x\rPAR,1.5\rPAR,much\r", &["band", "x"], |row| {
            sum += row.real(1)?;
            Ok(())
        });
        assert_eq!(sum, 1.5);
        let error = error.expect_err("refused").to_string();
        let expected = "t.csv, row 3: expected a number for x, found much";
        assert!(error.ends_with(expected), "{error}");
    }

    #[test]
    fn another_table_is_refused() {
        assert!(rows("a,b\n", &["band"], |_| Ok(())).is_err());
        assert!(rows("band,x\nPAR\n", &["band", "x"], |_| Ok(())).is_err());
    }

    #[test]
    fn columns_are_found_in_any_order() {
        let mut found = Vec::new();
        rows("new,x,band\n7,1.5,PAR\n", &["band", "x"], |row| {
            found.push((row.text(0).into_owned(), row.real(1)?));
            Ok(())
        })
        .expect("read");
        assert_eq!(found, [("PAR".to_owned(), 1.5)]);
    }

    #[cfg(unix)]
    #[test]
    fn a_table_without_end_is_refused() {
        for ending in ["csv", "parquet"] {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("t").with_extension(ending);
            std::os::unix::fs::symlink("/dev/zero", &path).expect("linked");
            assert!(Table::open(folder.path(), "t").is_err());
            fs::remove_file(&path).expect("removed");
            let file = File::create(&path).expect("made");
            file.set_len(1 << 40).expect("sparse");
            assert!(Table::open(folder.path(), "t").is_err());
        }
    }

    #[test]
    fn a_damaged_parquet_file_is_an_error_or_other_values() {
        let written = table::Table {
            name: "t",
            rows: 20,
            columns: vec![
                Column::index("triangle", |row| row / 2),
                Column::text("band", |row| ["PAR", "NIR"][row % 2]),
                Column::quantity("x", |row| row as f64 / 3.0),
            ],
        };
        let mut bytes = Vec::new();
        crate::parquet::write(&written, &mut bytes).expect("written");
        let folder = tempfile::tempdir().expect("a folder");
        let mut refused = 0;
        let mut read = |bytes: &[u8]| {
            fs::write(folder.path().join("t.parquet"), bytes).expect("written");
            let table = Table::open(folder.path(), "t");
            let rows = table.and_then(|mut table| {
                let each = |row: &Row<'_>| row.index(0).and(row.real(2)).map(drop);
                table.rows(&["triangle", "band", "x"], each)
            });
            refused += usize::from(rows.is_err());
        };
        for at in 0..bytes.len() {
            read(&bytes[..at]);
            for change in [0x15, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] ^= change;
                read(&damaged);
            }
        }
        assert!(refused > bytes.len());
    }

    /// Every table that is written reads back alike from both formats.
    #[test]
    fn parquet_was_refused() {
        let names = ["PAR", "a,\"b\""];
        let written = table::Table {
            name: "t",
            rows: 5,
            columns: vec![
                Column::index("triangle", |row| row / 2),
                Column::text("band", |row| names[row % 2]),
                Column::quantity("x", |row| row as f64 / 3.0),
            ],
        };
        let folder = tempfile::tempdir().expect("a folder");
        let read = || {
            let mut table = Table::open(folder.path(), "t").expect("there");
            let mut rows = Vec::new();
            let columns = ["x", "triangle", "band"];
            let each = |row: &Row<'_>| {
                let (x, triangle) = (row.real(0)?.to_bits(), row.index(1)?);
                rows.push((x, triangle, row.text(2).into_owned()));
                Ok(())
            };
            table.rows(&columns, each).expect("read");
            rows
        };
        let path = folder.path().join("t.parquet");
        let mut bytes = Vec::new();
        crate::parquet::write(&written, &mut bytes).expect("written");
        fs::write(&path, bytes).expect("written");
        let of_parquet = read();
        fs::remove_file(path).expect("removed");
        let mut bytes = Vec::new();
        crate::csv::write(&written, &mut bytes).expect("written");
        fs::write(folder.path().join("t.csv"), bytes).expect("written");
        assert_eq!(of_parquet.len(), 5);
        assert_eq!(of_parquet, read());
    }
}
