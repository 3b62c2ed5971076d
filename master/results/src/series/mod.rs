//! The result of a series: what a canopy absorbs at every moment, and over all of them.
//!
//! A folder with `series`, `balance`, `integrals`, `plants` and `species` as `.csv` or `.parquet`, and `summary.json`.

mod groups;
mod key;
mod part;
mod step;
mod summary;
mod tables;

use std::path::Path;

use nestrad_common::canopy::Canopy;
use nestrad_common::options::TableFormat;

use crate::atomic::{Staging, check_writable};
use crate::error::OutputError;
use crate::folder::{ALL_FILES, SUMMARY, write_table};

pub use key::key;
pub use part::{Part, PartError};
pub use step::{OrganStep, StepFacts, StepResult};
pub use summary::{BandSum, SeriesSummary};

/// A moment of a series.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesTime {
    /// As the weather has it.
    pub time: String,
    /// Of the sun above the horizon, degrees; negative by night.
    pub sun_elevation_deg: f64,
    /// The time that it stands for in integrals, s.
    pub weight_s: f64,
}

/// All that came of a series.
#[derive(Clone, Copy, Debug)]
pub struct SeriesResult<'a> {
    /// The canopy.
    pub canopy: &'a Canopy,
    /// Names of the bands.
    pub bands: &'a [&'a str],
    /// Photons of each band, µmol J⁻¹, where they are known.
    pub photon_umol_J: &'a [Option<f64>],
    /// One-sided area of each organ, m².
    pub organ_area_m2: &'a [f64],
    /// In their order.
    pub times: &'a [SeriesTime],
    /// For each of them what came of it; `None` where there was no light.
    pub steps: &'a [Option<StepResult>],
}

impl SeriesResult<'_> {
    /// What came of a moment for an organ in a band.
    fn organ(&self, step: usize, item: usize) -> OrganStep {
        let step = self.steps[step].as_ref();
        step.map_or_else(OrganStep::default, |step| step.organs[item])
    }

    /// Sums over time of what an organ absorbs in a band, J.
    fn integral(&self, item: usize, of: impl Fn(OrganStep) -> f64) -> f64 {
        let times = self.times.iter().enumerate();
        times
            .map(|(step, time)| time.weight_s * of(self.organ(step, item)))
            .sum()
    }

    /// Everything that the tables index by, so that they need not check.
    fn check(&self) -> Result<(), OutputError> {
        let organs = self.canopy.organs.len();
        let items = organs * self.bands.len();
        let lit = || self.steps.iter().flatten();
        let values = lit().map(|step| step.organs.len()).find(|&n| n != items);
        let balances = lit().map(|step| step.facts.balance.len());
        let balances = balances.into_iter().find(|&n| n != self.bands.len());
        for (what, expected, found) in [
            ("moments", self.times.len(), self.steps.len()),
            ("organ areas", organs, self.organ_area_m2.len()),
            ("organ values", items, values.unwrap_or(items)),
            ("photon factors", self.bands.len(), self.photon_umol_J.len()),
            (
                "balances",
                self.bands.len(),
                balances.unwrap_or(self.bands.len()),
            ),
        ] {
            if expected != found {
                return Err(OutputError::Mismatch {
                    what,
                    expected,
                    found,
                });
            }
        }
        Ok(())
    }
}

/// Refuses a folder that a series could not be written into; for its beginning.
pub fn check_place(dir: &Path) -> Result<(), OutputError> {
    check_writable(dir, &ALL_FILES)
}

/// Writes a series into `dir`: all of it, or nothing.
pub fn write(
    dir: &Path,
    result: &SeriesResult<'_>,
    format: TableFormat,
    summary: &SeriesSummary<'_>,
) -> Result<(), OutputError> {
    result.check()?;
    let mut staging = Staging::begin(dir)?;
    for table in tables::all(result) {
        write_table(&mut staging, &table, format)?;
    }
    staging.write(SUMMARY, |out| summary.write(out))?;
    staging.commit(SUMMARY, &ALL_FILES)
}
