//! How plants stand in a field: rows along x.

use glam::DVec2;

use super::canopy::Label;
use super::{GenerateError, check};
use crate::canopy::Pattern;

/// Rows of plants; the pattern is the ground they take, centred on the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Number of rows, 1 or more.
    pub rows: u32,
    /// Number of plants in a row, 1 or more.
    pub plants_per_row: u32,
    /// From row to row (along y), metres.
    pub row_spacing_m: f64,
    /// From plant to plant in a row (along x), metres.
    pub plant_spacing_m: f64,
}

impl Stand {
    pub(super) fn check(&self) -> Result<(), GenerateError> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let plants = f64::from(self.rows) * f64::from(self.plants_per_row);
        check(
            (1.0..=f64::from(Label::MAX_PLANT)).contains(&plants),
            "number of plants",
            plants,
            "1 to 99999",
        )?;
        for (name, spacing) in [
            ("row spacing", self.row_spacing_m),
            ("plant spacing", self.plant_spacing_m),
        ] {
            check(
                positive(spacing),
                name,
                spacing,
                "a positive length in metres",
            )?;
        }
        Ok(())
    }

    pub(super) fn pattern(&self) -> Pattern {
        let cells = DVec2::new(f64::from(self.plants_per_row), f64::from(self.rows));
        let size_m = cells * self.cell();
        Pattern {
            min_m: -0.5 * size_m,
            size_m,
        }
    }

    /// Plant numbers, from 1, and where they stand: in the middle of their cells.
    pub(super) fn plants(&self) -> impl Iterator<Item = (u32, DVec2)> {
        let cell = self.cell();
        let first = self.pattern().min_m + 0.5 * cell;
        let per_row = self.plants_per_row;
        (0..self.rows * per_row).map(move |i| {
            let place = DVec2::new(f64::from(i % per_row), f64::from(i / per_row));
            (i + 1, first + place * cell)
        })
    }

    fn cell(&self) -> DVec2 {
        DVec2::new(self.plant_spacing_m, self.row_spacing_m)
    }
}
