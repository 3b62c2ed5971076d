//! A table, described once: its columns and what stands in them. CSV and Parquet both write from it.

use std::rc::Rc;

use crate::error::Fault;
use crate::number::{round_to_micrometre, round_to_nine_digits};

/// Named columns of equal length, whose cells are computed as they are written.
pub(crate) struct Table<'a> {
    /// Name of the table, and of its file without the extension.
    pub(crate) name: &'static str,
    pub(crate) rows: usize,
    pub(crate) columns: Vec<Column<'a>>,
}

/// A column: its name, with the unit, and its cells by row.
pub(crate) struct Column<'a> {
    pub(crate) name: &'static str,
    pub(crate) cells: Cells<'a>,
}

/// The cells of a column, by row.
#[derive(Clone)]
pub(crate) enum Cells<'a> {
    Text(Rc<dyn Fn(usize) -> &'a str + 'a>),
    Index(Rc<dyn Fn(usize) -> usize + 'a>),
    /// Rounded already, but perhaps not finite: read through [`Column::finite`].
    Real(Rc<dyn Fn(usize) -> f64 + 'a>),
    /// The same, with empty cells.
    Sparse(Rc<dyn Fn(usize) -> Option<f64> + 'a>),
}

impl<'a> Column<'a> {
    pub(crate) fn text(name: &'static str, cell: impl Fn(usize) -> &'a str + 'a) -> Self {
        let cells = Cells::Text(Rc::new(cell));
        Self { name, cells }
    }

    pub(crate) fn index(name: &'static str, cell: impl Fn(usize) -> usize + 'a) -> Self {
        let cells = Cells::Index(Rc::new(cell));
        Self { name, cells }
    }

    /// A quantity, written with nine significant digits.
    pub(crate) fn quantity(name: &'static str, cell: impl Fn(usize) -> f64 + 'a) -> Self {
        let cells = Cells::Real(Rc::new(move |row| round_to_nine_digits(cell(row))));
        Self { name, cells }
    }

    /// A quantity that is not known in every row.
    pub(crate) fn sparse(name: &'static str, cell: impl Fn(usize) -> Option<f64> + 'a) -> Self {
        let cells = Cells::Sparse(Rc::new(move |row| cell(row).map(round_to_nine_digits)));
        Self { name, cells }
    }

    /// A position in metres, written to the micrometre.
    pub(crate) fn coordinate(name: &'static str, cell: impl Fn(usize) -> f64 + 'a) -> Self {
        let cells = Cells::Real(Rc::new(move |row| round_to_micrometre(cell(row))));
        Self { name, cells }
    }

    /// `value`, which stands in `row` of this column, if it is a number that a file may hold.
    pub(crate) fn finite(&self, row: usize, value: f64) -> Result<f64, Fault> {
        if value.is_finite() {
            return Ok(value);
        }
        let place = format!("{} in row {row}", self.name);
        Err(Fault::NotFinite { place, value })
    }
}
