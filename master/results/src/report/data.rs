//! The results of a solve, read back from its folder.

use std::collections::HashMap;
use std::path::Path;

use nestrad_common::bounded::{self, Limit};
use nestrad_common::options::{Unit, Up};
use nestrad_engine::rounds::Accuracy;
use nestrad_engine::solution::Balance;
use serde::de::Error;
use serde::{Deserialize, Serialize};

use super::error::ReportError;
use super::profile::PatchLight;
use super::table::Table;

/// What a report needs of `summary.json`.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct SummaryFacts {
    pub(crate) version: String,
    pub(crate) options: OptionFacts,
    pub(crate) scene: SceneFacts,
    pub(crate) plan: PlanFacts,
    pub(crate) energy_balance: Vec<Balance>,
    pub(crate) error_estimates: Vec<SpreadFacts>,
    pub(crate) resources: serde_json::Value,
}

/// The options that were in force.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct OptionFacts {
    pub(crate) scenes: Vec<String>,
    pub(crate) unit: Unit,
    /// Results of an earlier version do not have it.
    #[serde(default)]
    pub(crate) up: Up,
    pub(crate) light: String,
    pub(crate) sources: usize,
    pub(crate) bands: Vec<BandFacts>,
    pub(crate) accuracy_percent: f64,
    pub(crate) seed: u64,
}

/// A band as it was asked for.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct BandFacts {
    /// Of the horizontal above the canopy; results of an earlier version do not have it.
    pub(crate) irradiance_W_m2: Option<f64>,
}

/// The scene in short.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct SceneFacts {
    pub(crate) lower_m: [f64; 3],
    pub(crate) upper_m: [f64; 3],
    pub(crate) pattern_m: Option<[f64; 2]>,
    pub(crate) soil_z_m: Option<f64>,
    pub(crate) plants: usize,
    pub(crate) area_index: Option<f64>,
}

impl SceneFacts {
    /// Extent of the pattern, or of the box around a scene that stands alone.
    pub(crate) fn ground_m(&self) -> [f64; 2] {
        let side = |axis: usize| self.upper_m[axis] - self.lower_m[axis];
        self.pattern_m.unwrap_or([side(0), side(1)])
    }
}

impl SummaryFacts {
    /// Irradiance of the horizontal above the canopy, per band.
    pub(crate) fn above_W_m2(&self) -> Vec<f64> {
        let ground_m2 = self.plan.scale.ground_area_m2;
        let bands = self.options.bands.iter().zip(&self.energy_balance);
        bands
            .map(|(band, b)| band.irradiance_W_m2.unwrap_or(b.incoming_W / ground_m2))
            .collect()
    }
}

/// What the plan said.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct PlanFacts {
    pub(crate) scale: ScaleFacts,
    pub(crate) reasons: Vec<String>,
    /// What the errors come from; results of an earlier version do not have it.
    pub(crate) accuracy: Option<Accuracy>,
}

/// Sizes that the plan is made by.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct ScaleFacts {
    pub(crate) ground_area_m2: f64,
}

/// Standard error over all organs.
#[derive(Clone, Debug, Deserialize, Serialize)]
pub(crate) struct SpreadFacts {
    pub(crate) band: String,
    pub(crate) rms_percent: Option<f64>,
}

/// An organ and its light.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Organ {
    pub(crate) species: String,
    pub(crate) plant: String,
    pub(crate) organ: String,
    pub(crate) kind: String,
    pub(crate) area_m2: f64,
    /// Per band.
    pub(crate) light: Vec<OrganLight>,
}

/// The light of an organ in a band.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct OrganLight {
    pub(crate) upper_W_m2: f64,
    pub(crate) lower_W_m2: f64,
    pub(crate) absorbed_W: f64,
    pub(crate) direct_W: f64,
    pub(crate) se_W: f64,
}

/// Triangles and their light.
#[derive(Clone, Debug, Default)]
pub(crate) struct Triangles {
    pub(crate) area_m2: Vec<f64>,
    /// Index of its organ in the table of organs.
    pub(crate) organ: Vec<u32>,
    /// Whether it is a part of a plant.
    pub(crate) plant: Vec<bool>,
    /// Bands of a triangle one after the other.
    pub(crate) light: Vec<PatchLight>,
}

/// The soil plane and its light.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Soil {
    pub(crate) nx: usize,
    pub(crate) ny: usize,
    /// Centre of the first cell, in the user's coordinates.
    pub(crate) first_m: [f64; 2],
    pub(crate) cell_m: [f64; 2],
    /// Per band and cell.
    pub(crate) irradiance_W_m2: Vec<Vec<f32>>,
}

/// All of a result.
#[derive(Clone, Debug)]
pub(crate) struct Results {
    pub(crate) summary: SummaryFacts,
    pub(crate) bands: Vec<String>,
    pub(crate) organs: Vec<Organ>,
    pub(crate) triangles: Triangles,
    pub(crate) soil: Option<Soil>,
}

/// A summary names materials and warnings, and is no larger than this.
const SUMMARY: Limit = Limit::fixed(64 << 20);

/// Kinds that are parts of plants.
const PLANTS: [&str; 2] = ["leaf", "stem"];

/// Reads a folder of results.
pub(crate) fn read(folder: &Path) -> Result<Results, ReportError> {
    let summary = summary(folder)?;
    let balance = summary.energy_balance.iter();
    let bands: Vec<String> = balance.map(|balance| balance.band.clone()).collect();
    let organs = organs(folder, &bands)?;
    let triangles = triangles(folder, &bands, &organs)?;
    let soil = match Table::find(folder, "soil")? {
        Some(mut table) => soil(&mut table, &bands)?,
        None => None,
    };
    Ok(Results {
        summary,
        bands,
        organs,
        triangles,
        soil,
    })
}

fn summary(folder: &Path) -> Result<SummaryFacts, ReportError> {
    let path = folder.join("summary.json");
    if !path.exists() {
        let folder = folder.to_owned();
        return Err(ReportError::NoResult { folder });
    }
    let text = match bounded::read(&path, SUMMARY) {
        Ok(text) => text,
        Err(source) => return Err(ReportError::Read { path, source }),
    };
    let read = serde_json::from_slice(&text).and_then(|summary: SummaryFacts| {
        if summary.energy_balance.is_empty() {
            return Err(serde_json::Error::custom("energy_balance has no bands"));
        }
        if summary.options.bands.len() != summary.energy_balance.len() {
            let fault = "options and energy_balance have different numbers of bands";
            return Err(serde_json::Error::custom(fault));
        }
        Ok(summary)
    });
    read.map_err(|source| ReportError::Summary { path, source })
}

fn organs(folder: &Path, bands: &[String]) -> Result<Vec<Organ>, ReportError> {
    let columns = [
        "species",
        "plant",
        "organ",
        "kind",
        "area_m2",
        "band",
        "irradiance_upper_W_m2",
        "irradiance_lower_W_m2",
        "absorbed_W",
        "absorbed_direct_W",
        "absorbed_se_W",
    ];
    let mut organs: Vec<Organ> = Vec::new();
    let mut rows = 0;
    let mut table = Table::open(folder, "organs")?;
    table.rows(&columns, |row| {
        row.must_be(5, &bands[rows % bands.len()])?;
        if rows.is_multiple_of(bands.len()) {
            organs.push(Organ {
                species: row.text(0).into_owned(),
                plant: row.text(1).into_owned(),
                organ: row.text(2).into_owned(),
                kind: row.text(3).into_owned(),
                area_m2: row.real(4)?,
                light: Vec::with_capacity(bands.len()),
            });
        }
        if let Some(organ) = organs.last_mut() {
            organ.light.push(OrganLight {
                upper_W_m2: row.real(6)?,
                lower_W_m2: row.real(7)?,
                absorbed_W: row.real(8)?,
                direct_W: row.real(9)?,
                se_W: row.real(10)?,
            });
        }
        rows += 1;
        Ok(())
    })?;
    if !rows.is_multiple_of(bands.len()) {
        return Err(table.is_cut_off(rows));
    }
    Ok(organs)
}

fn triangles(folder: &Path, bands: &[String], organs: &[Organ]) -> Result<Triangles, ReportError> {
    let columns = [
        "triangle",
        "species",
        "plant",
        "organ",
        "kind",
        "area_m2",
        "band",
        "irradiance_upper_W_m2",
        "irradiance_lower_W_m2",
        "absorbed_W_m2",
        "absorbed_direct_W_m2",
    ];
    let names = organs.iter().map(|organ| {
        let Organ {
            species,
            plant,
            organ,
            ..
        } = organ;
        [species, plant, organ].map(String::as_str)
    });
    let by_name: HashMap<[&str; 3], u32> = names.zip(0..).collect();
    let mut table = Table::open(folder, "triangles")?;
    let mut found = Triangles::default();
    table.rows(&columns, |row| {
        let (triangle, band) = (
            found.light.len() / bands.len(),
            found.light.len() % bands.len(),
        );
        if row.index(0)? != triangle {
            return Err(row.not(&format!("triangle {triangle}"), &row.text(0)));
        }
        row.must_be(6, &bands[band])?;
        if band == 0 {
            let name = [1, 2, 3].map(|column| row.text(column));
            let organ = by_name.get(&name.each_ref().map(|name| &**name)).copied();
            let organ =
                organ.ok_or_else(|| row.not("an organ of the table of organs", &row.text(3)))?;
            found.organ.push(organ);
            found.plant.push(PLANTS.contains(&&*row.text(4)));
            found.area_m2.push(row.real(5)?);
        }
        found.light.push(PatchLight {
            irradiance_W_m2: row.real(7)? + row.real(8)?,
            absorbed_W_m2: row.real(9)?,
            direct_W_m2: row.real(10)?,
        });
        Ok(())
    })?;
    if !found.light.len().is_multiple_of(bands.len()) {
        return Err(table.is_cut_off(found.light.len()));
    }
    Ok(found)
}

fn soil(table: &mut Table, bands: &[String]) -> Result<Option<Soil>, ReportError> {
    let columns = [
        "ix",
        "iy",
        "x_m",
        "y_m",
        "cell_x_m",
        "cell_y_m",
        "band",
        "irradiance_W_m2",
    ];
    let mut soil: Option<Soil> = None;
    let mut rows = 0;
    table.rows(&columns, |row| {
        let band = rows % bands.len();
        row.must_be(6, &bands[band])?;
        let place = [row.real(2)?, row.real(3)?];
        let cell_m = [row.real(4)?, row.real(5)?];
        let soil = soil.get_or_insert_with(|| Soil {
            nx: 0,
            ny: 0,
            first_m: place,
            cell_m,
            irradiance_W_m2: vec![Vec::new(); bands.len()],
        });
        // cells come row by row: the last one has the largest numbers
        let [ix, iy] = [row.index(0)?, row.index(1)?];
        (soil.nx, soil.ny) = (ix.saturating_add(1), iy.saturating_add(1));
        soil.irradiance_W_m2[band].push(row.real(7)? as f32);
        rows += 1;
        Ok(())
    })?;
    let cells = soil
        .as_ref()
        .map_or(0, |soil| soil.nx.saturating_mul(soil.ny));
    if rows != cells.saturating_mul(bands.len()) {
        return Err(table.is_cut_off(rows));
    }
    Ok(soil)
}
