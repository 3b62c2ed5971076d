//! Tables as Apache Parquet: the columns of the CSV, with their types.
//!
//! Text is dictionary-encoded (a handful of names in many rows), indices as small differences, and
//! numbers are plain doubles, which every reader knows; all pages are compressed with Snappy.

use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, Encoding, LogicalType, Repetition, Type as Physical};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::errors::ParquetError;
use parquet::file::properties::{WriterProperties, WriterPropertiesPtr};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type, TypePtr};

use crate::error::Fault;
use crate::table::{Cells, Column, Table};

/// Bounds the memory that writing takes: a column of a group is held at once.
const ROWS_PER_GROUP: usize = 1 << 17;

/// Writes the whole table.
pub(crate) fn write(table: &Table<'_>, out: impl Write + Send) -> Result<(), Fault> {
    let mut file = SerializedFileWriter::new(out, schema(table)?, properties(table))?;
    for first in (0..table.rows).step_by(ROWS_PER_GROUP) {
        let rows = first..table.rows.min(first + ROWS_PER_GROUP);
        let mut group = file.next_row_group()?;
        for column in &table.columns {
            let mut writer = group.next_column()?.ok_or_else(one_writer_per_column)?;
            match (&column.cells, writer.untyped()) {
                (Cells::Text(cell), ColumnWriter::ByteArrayColumnWriter(writer)) => {
                    let texts: Vec<ByteArray> = rows.clone().map(|row| cell(row).into()).collect();
                    writer.write_batch(&texts, None, None)?;
                }
                (Cells::Index(cell), ColumnWriter::Int64ColumnWriter(writer)) => {
                    let indices: Vec<i64> = rows.clone().map(|row| cell(row) as i64).collect();
                    writer.write_batch(&indices, None, None)?;
                }
                (Cells::Real(cell), ColumnWriter::DoubleColumnWriter(writer)) => {
                    let reals: Vec<f64> = rows
                        .clone()
                        .map(|row| column.finite(row, cell(row)))
                        .collect::<Result<_, _>>()?;
                    writer.write_batch(&reals, None, None)?;
                }
                (Cells::Sparse(cell), ColumnWriter::DoubleColumnWriter(writer)) => {
                    let known = |row| cell(row).map(|value| column.finite(row, value));
                    let levels: Vec<i16> =
                        rows.clone().map(|row| cell(row).is_some().into()).collect();
                    let reals: Vec<f64> =
                        rows.clone().filter_map(known).collect::<Result<_, _>>()?;
                    writer.write_batch(&reals, Some(&levels), None)?;
                }
                _ => return Err(one_writer_per_column().into()),
            }
            writer.close()?;
        }
        group.close()?;
    }
    file.close()?;
    Ok(())
}

/// The writers are those of the schema, which is made of the very columns: this does not happen.
fn one_writer_per_column() -> ParquetError {
    ParquetError::General("columns and schema differ".into())
}

fn schema(table: &Table<'_>) -> Result<TypePtr, ParquetError> {
    let fields: Result<Vec<TypePtr>, ParquetError> = table.columns.iter().map(field).collect();
    let schema = Type::group_type_builder(table.name)
        .with_fields(fields?)
        .build()?;
    Ok(Arc::new(schema))
}

fn field(column: &Column<'_>) -> Result<TypePtr, ParquetError> {
    let (physical, logical) = match column.cells {
        Cells::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Cells::Index(_) => (Physical::INT64, None),
        Cells::Real(_) | Cells::Sparse(_) => (Physical::DOUBLE, None),
    };
    let repetition = match column.cells {
        Cells::Sparse(_) => Repetition::OPTIONAL,
        _ => Repetition::REQUIRED,
    };
    let field = Type::primitive_type_builder(column.name, physical)
        .with_repetition(repetition)
        .with_logical_type(logical)
        .build()?;
    Ok(Arc::new(field))
}

fn properties(table: &Table<'_>) -> WriterPropertiesPtr {
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false);
    for column in &table.columns {
        let path = ColumnPath::from(column.name);
        properties = match column.cells {
            Cells::Text(_) => properties.set_column_dictionary_enabled(path, true),
            Cells::Index(_) => properties.set_column_encoding(path, Encoding::DELTA_BINARY_PACKED),
            Cells::Real(_) | Cells::Sparse(_) => {
                properties.set_column_encoding(path, Encoding::PLAIN)
            }
        };
    }
    Arc::new(properties.build())
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    fn written(table: &Table<'_>) -> Result<Vec<u8>, Fault> {
        let mut out = Vec::new();
        write(table, &mut out)?;
        Ok(out)
    }

    fn table<'a>(rows: usize, names: &'a [&str]) -> Table<'a> {
        Table {
            name: "test",
            rows,
            columns: vec![
                Column::index("triangle", |row| row / 2),
                Column::text("band", |row| names[row % names.len()]),
                Column::quantity("absorbed_W", |row| row as f64 / 3.0),
            ],
        }
    }

    #[test]
    fn rows_read_back_across_groups() {
        let rows = ROWS_PER_GROUP + 3;
        let names = ["PAR", "a,\"b\"", "é"];
        let bytes = written(&table(rows, &names)).expect("written");
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).expect("a parquet file");
        assert_eq!(reader.num_row_groups(), 2);
        let mut count = 0;
        for (row, record) in reader.get_row_iter(None).expect("rows").enumerate() {
            let record = record.expect("a row");
            assert_eq!(record.get_long(0).expect("an index"), (row / 2) as i64);
            assert_eq!(record.get_string(1).expect("a text"), names[row % 3]);
            let expected = crate::number::round_to_nine_digits(row as f64 / 3.0);
            assert_eq!(
                record.get_double(2).expect("a number").to_bits(),
                expected.to_bits()
            );
            count += 1;
        }
        assert_eq!(count, rows);
    }

    #[test]
    fn the_schema_is_that_of_the_columns() {
        let bytes = written(&table(0, &["PAR"])).expect("written");
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).expect("a parquet file");
        let schema = reader.metadata().file_metadata().schema_descr();
        let columns: Vec<_> = schema
            .columns()
            .iter()
            .map(|c| (c.name(), c.physical_type()))
            .collect();
        assert_eq!(
            columns,
            [
                ("triangle", Physical::INT64),
                ("band", Physical::BYTE_ARRAY),
                ("absorbed_W", Physical::DOUBLE),
            ]
        );
    }

    #[test]
    fn the_same_table_gives_the_same_bytes() {
        let table = table(1000, &["PAR", "NIR"]);
        assert_eq!(
            written(&table).expect("written"),
            written(&table).expect("written")
        );
    }

    #[test]
    fn infinities_are_refused() {
        let bad = Table {
            name: "test",
            rows: 1,
            columns: vec![Column::quantity("absorbed_W", |_| f64::NAN)],
        };
        let error = written(&bad).expect_err("refused").to_string();
        assert_eq!(error, "absorbed_W in row 0 is NaN, not a finite number");
    }
}
