//! `summary.json` of a series.

use std::io::Write;

use nestrad_engine::stopwatch::{Stage, Usage};
use serde::Serialize;

use crate::error::Fault;
use crate::{finite, json};

/// All sections of the summary. What is behind `dyn` is written as whoever computed it describes it.
#[derive(Serialize)]
pub struct SeriesSummary<'a> {
    /// Version of nestrad.
    pub version: &'a str,
    /// The options in force, defaults included.
    pub options: &'a dyn erased_serde::Serialize,
    /// Facts of the scene: counts, areas, extent.
    pub scene: &'a dyn erased_serde::Serialize,
    /// What was decided for all moments, and by which of them.
    pub plan: &'a dyn erased_serde::Serialize,
    /// Rows of the weather.
    pub moments: usize,
    /// Those with light.
    pub lit_moments: usize,
    /// The largest error of organs at any moment, percent.
    pub largest_error_percent: Option<f64>,
    /// Moments with an error larger than asked for.
    pub moments_beyond_target: usize,
    /// How integrals are made.
    pub integration: &'a str,
    /// Sums over time.
    pub bands: &'a [BandSum],
    /// The cost of each stage.
    pub stages: &'a [Stage],
    /// The cost of the whole.
    pub resources: Usage,
}

/// Where the energy of a band went over the series, J per pattern (or per scene, when there is no pattern).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BandSum {
    /// Its name.
    pub band: String,
    /// Photons of a joule, µmol, where they are known.
    pub photon_umol_J: Option<f64>,
    /// What the sources bring.
    pub incoming_J: f64,
    /// Absorbed by plants.
    pub absorbed_plants_J: f64,
    /// Absorbed by soil.
    pub absorbed_soil_J: f64,
    /// Left upwards or downwards.
    pub escaped_J: f64,
    /// Scattered and not followed.
    pub scattered_J: f64,
    /// What is not accounted for.
    pub closure_J: f64,
}

impl SeriesSummary<'_> {
    /// Writes the summary as indented JSON. A number that is not finite is an error that says where it stands.
    pub fn write(&self, out: &mut impl Write) -> Result<(), Fault> {
        finite::check(self)?;
        json::write_indented(self, out)?;
        out.write_all(b"\n")?;
        Ok(())
    }
}
