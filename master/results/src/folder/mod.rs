//! A result as a folder of files.

use std::path::Path;

use nestrad_common::canopy::Canopy;
use nestrad_common::options::TableFormat;
use nestrad_engine::solution::Solution;

use crate::atomic::{Staging, check_writable};
use crate::error::OutputError;
use crate::summary::Summary;
use crate::table::Table;
use crate::{csv, parquet, sensors, tables, vtp};

/// Which files a result has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Formats {
    /// Format of all tables.
    pub table: TableFormat,
    /// Whether to write `canopy.vtp`, the triangles coloured by their light.
    pub vtp: bool,
}

pub(crate) const SUMMARY: &str = "summary.json";
const SURFACE: &str = "canopy.vtp";
/// The page that is made of a result.
pub(crate) const REPORT: &str = "report.html";

/// All that a run may write, of a solve or a series: what is not part of a result is removed from an earlier one's folder,
/// so that a folder never shows two results at once.
pub(crate) const ALL_FILES: [&str; 23] = [
    "organs.csv",
    "organs.parquet",
    "triangles.csv",
    "triangles.parquet",
    "soil.csv",
    "soil.parquet",
    "sensors.csv",
    "sensors.parquet",
    "radiance.csv",
    "radiance.parquet",
    SURFACE,
    // of a series
    "series.csv",
    "series.parquet",
    "balance.csv",
    "balance.parquet",
    "integrals.csv",
    "integrals.parquet",
    "plants.csv",
    "plants.parquet",
    "species.csv",
    "species.parquet",
    // made of a result by `nestrad report`: it does not outlive it
    REPORT,
    SUMMARY,
];

/// Refuses a folder that a result could not be written into; for the beginning of a solve.
pub fn check_place(dir: &Path) -> Result<(), OutputError> {
    check_writable(dir, &ALL_FILES)
}

/// A result that lies complete beside its place, but for its summary.
#[derive(Debug)]
pub struct StagedResult {
    staging: Staging,
}

/// Writes tables and surface beside their places in `dir`. They appear there with
/// [`StagedResult::commit`]; without it nothing changes.
///
/// `band_names` are in the order of the solution's bands.
pub fn stage(
    dir: &Path,
    canopy: &Canopy,
    band_names: &[&str],
    solution: &Solution,
    formats: Formats,
) -> Result<StagedResult, OutputError> {
    check_counts(canopy, band_names.len(), solution)?;
    let mut staging = Staging::begin(dir)?;
    let soil = solution.soil.as_ref();
    let tables = [
        Some(tables::organs(canopy, band_names, solution)),
        Some(tables::triangles(canopy, band_names, solution)),
        soil.map(|map| tables::soil(canopy, band_names, map)),
    ];
    let of_sensors = sensors::tables(canopy.origin_m, band_names, &solution.readings);
    for table in tables.iter().flatten().chain(&of_sensors) {
        write_table(&mut staging, table, formats.table)?;
    }
    if formats.vtp {
        staging.write(SURFACE, |out| vtp::write(canopy, band_names, solution, out))?;
    }
    Ok(StagedResult { staging })
}

impl StagedResult {
    /// Adds the summary and puts all files in their places.
    pub fn commit(mut self, summary: &Summary<'_>) -> Result<(), OutputError> {
        self.staging.write(SUMMARY, |out| summary.write(out))?;
        self.staging.commit(SUMMARY, &ALL_FILES)
    }
}

/// Writes a whole result into `dir`: [`stage`] and [`StagedResult::commit`] in one.
pub fn write_all(
    dir: &Path,
    canopy: &Canopy,
    band_names: &[&str],
    solution: &Solution,
    formats: Formats,
    summary: &Summary<'_>,
) -> Result<(), OutputError> {
    stage(dir, canopy, band_names, solution, formats)?.commit(summary)
}

pub(crate) fn write_table(
    staging: &mut Staging,
    table: &Table<'_>,
    format: TableFormat,
) -> Result<(), OutputError> {
    match format {
        TableFormat::Csv => {
            staging.write(&format!("{}.csv", table.name), |out| csv::write(table, out))
        }
        TableFormat::Parquet => staging.write(&format!("{}.parquet", table.name), |out| {
            parquet::write(table, out)
        }),
    }
}

/// Everything that the tables index by, so that they need not check.
fn check_counts(canopy: &Canopy, bands: usize, solution: &Solution) -> Result<(), OutputError> {
    let (organs, triangles) = (canopy.organs.len(), canopy.len());
    let soil = solution.soil.as_ref();
    let soil_cells = soil.map_or(0, |map| map.nx * map.ny);
    let soil_values = soil.map_or(0, |map| map.irradiance_W_m2.len());
    let mut lights = solution.readings.iter().map(|reading| reading.light.len());
    if let Some(found) = lights.find(|&found| found != bands) {
        return Err(OutputError::Mismatch {
            what: "bands of a sensor",
            expected: bands,
            found,
        });
    }
    let has_sun = !solution.organ_sunlit_m2.is_empty();
    let sunlit_organs = if has_sun { organs } else { 0 };
    let of_triangles = canopy.triangles().map(|triangle| triangle.organ);
    for (what, expected, found) in [
        ("organ values", organs * bands, solution.organs.len()),
        ("organ biases", organs * bands, solution.organ_bias_W.len()),
        (
            "triangle values",
            triangles * bands,
            solution.triangles.len(),
        ),
        ("organ areas", organs, solution.organ_area_m2.len()),
        ("triangle areas", triangles, solution.triangle_area_m2.len()),
        (
            "sunlit areas",
            sunlit_organs,
            solution.organ_sunlit_m2.len(),
        ),
        ("soil values", soil_cells * bands, soil_values),
    ] {
        if expected != found {
            return Err(OutputError::Mismatch {
                what,
                expected,
                found,
            });
        }
    }
    let needed = of_triangles.max().map_or(0, |last| last as usize + 1);
    if needed > organs {
        let what = "organs";
        return Err(OutputError::Mismatch {
            what,
            expected: needed,
            found: organs,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
