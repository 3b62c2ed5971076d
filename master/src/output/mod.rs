//! Results as files: tables, a surface for ParaView, a summary. What is shown on the terminal, and
//! what a run costs, is here too.
//!
//! A result is a folder: `organs`, `triangles` and (where there is a soil plane) `soil` as `.csv` or
//! `.parquet`, `canopy.vtp` if asked for, and `summary.json`, which is written last: see
//! [`atomic`] for what that means to a reader of the folder.

pub mod atomic;
pub(crate) mod csv;
mod error;
mod finite;
pub(crate) mod number;
mod parquet;
pub mod progress;
pub mod resources;
pub mod summary;
pub(crate) mod table;
mod tables;
pub mod terminal;
mod vtk_xml;
mod vtp;

use std::path::Path;

use nestrad_common::scene::Scene;

pub use self::atomic::check_writable;
pub use self::error::{Fault, OutputError};

use self::atomic::Staging;
use self::summary::Summary;
use self::table::Table;
use crate::solution::Solution;

/// How tables are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TableFormat {
    /// Comma-separated text.
    #[default]
    Csv,
    /// Apache Parquet with the same columns.
    Parquet,
}

/// Which files a result has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Formats {
    /// Format of all tables.
    pub table: TableFormat,
    /// Whether to write `canopy.vtp`, the triangles coloured by their light.
    pub vtp: bool,
}

const SUMMARY: &str = "summary.json";
const SURFACE: &str = "canopy.vtp";
/// The page that is made of a result.
pub(crate) const REPORT: &str = "report.html";

/// All that a run may write: what is not part of a result is removed from an earlier one's folder,
/// so that a folder never shows two results at once.
const ALL_FILES: [&str; 9] = [
    "organs.csv",
    "organs.parquet",
    "triangles.csv",
    "triangles.parquet",
    "soil.csv",
    "soil.parquet",
    SURFACE,
    // made of a result by `nestrad report`: it does not outlive it
    REPORT,
    SUMMARY,
];

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
    scene: &Scene,
    band_names: &[&str],
    solution: &Solution,
    formats: Formats,
) -> Result<StagedResult, OutputError> {
    check_counts(scene, band_names.len(), solution)?;
    let mut staging = Staging::begin(dir)?;
    let soil = solution.soil.as_ref();
    let tables = [
        Some(tables::organs(scene, band_names, solution)),
        Some(tables::triangles(scene, band_names, solution)),
        soil.map(|map| tables::soil(scene, band_names, map)),
    ];
    for table in tables.iter().flatten() {
        write_table(&mut staging, table, formats.table)?;
    }
    if formats.vtp {
        staging.write(SURFACE, |out| vtp::write(scene, band_names, solution, out))?;
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
    scene: &Scene,
    band_names: &[&str],
    solution: &Solution,
    formats: Formats,
    summary: &Summary<'_>,
) -> Result<(), OutputError> {
    stage(dir, scene, band_names, solution, formats)?.commit(summary)
}

fn write_table(
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
fn check_counts(scene: &Scene, bands: usize, solution: &Solution) -> Result<(), OutputError> {
    let organs = scene.organs.len();
    let triangles = scene.triangles.len();
    let soil = solution.soil.as_ref();
    let soil_cells = soil.map_or(0, |map| map.nx * map.ny);
    let soil_values = soil.map_or(0, |map| map.irradiance_W_m2.len());
    for (what, expected, found) in [
        ("organ values", organs * bands, solution.organs.len()),
        (
            "triangle values",
            triangles * bands,
            solution.triangles.len(),
        ),
        ("organ areas", organs, solution.organ_area_m2.len()),
        ("triangle areas", triangles, solution.triangle_area_m2.len()),
        ("organs of triangles", triangles, scene.organ.len()),
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
    let needed = scene
        .organ
        .iter()
        .max()
        .map_or(0, |&last| last as usize + 1);
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
