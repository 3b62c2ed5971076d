//! Light files to sources: one source per direction, with an irradiance for each band.

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

use super::{LoadError, name};
use crate::formats::light::{LightSource, parse};
use crate::formats::read::{SMALL, read};
use crate::light::Source;

/// The sources of a `.light` file and the bands they shine in.
#[derive(Clone, Debug, PartialEq)]
pub struct LightFile {
    /// As the file has them.
    pub sources: Vec<LightSource>,
    /// The number of the band; `None` for all bands alike.
    pub band: Option<usize>,
}

impl LightFile {
    pub(super) fn read(path: &Path) -> Result<Self, LoadError> {
        let bytes = read(path, SMALL, "light (.light)")?;
        Ok(Self {
            sources: parse(&name(path), &bytes)?,
            band: None,
        })
    }
}

/// One file per band, in the order of the bands.
pub(super) fn per_band(
    files: &BTreeMap<String, PathBuf>,
    bands: &[String],
) -> Result<Vec<LightFile>, LoadError> {
    let paths = values_per_band(files, bands)?;
    let files = paths.iter().enumerate().map(|(band, path)| {
        let file = LightFile::read(path)?;
        Ok(LightFile {
            band: Some(band),
            ..file
        })
    });
    files.collect()
}

/// Values by name, in the order of the bands; there must be one for each band and no other.
pub(super) fn values_per_band<T: Clone>(
    values: &BTreeMap<String, T>,
    bands: &[String],
) -> Result<Vec<T>, LoadError> {
    let found: Option<Vec<T>> = bands.iter().map(|band| values.get(band).cloned()).collect();
    found
        .filter(|found| found.len() == values.len())
        .ok_or_else(|| LoadError::LightBands {
            given: values.keys().cloned().collect::<Vec<_>>().join(", "),
            expected: bands.join(", "),
        })
}

/// Sources in order of first appearance. Those of identical direction become one: the light of
/// several bands, or of several lines, then costs a single projection. Sources without light in any
/// band are left out.
pub fn merge_sources(files: &[LightFile], bands: usize) -> Vec<Source> {
    let mut sources: Vec<Source> = Vec::new();
    let mut known = HashMap::new();
    for file in files {
        for given in &file.sources {
            // adding zero makes 0 of -0, which has other bits and the same direction
            let key = given
                .direction
                .to_array()
                .map(|value| (value + 0.0).to_bits());
            let index = *known.entry(key).or_insert_with(|| {
                sources.push(Source {
                    direction: given.direction,
                    irradiance_W_m2: vec![0.0; bands],
                });
                sources.len() - 1
            });
            let shines = sources[index].irradiance_W_m2.iter_mut().enumerate();
            for (band, irradiance) in shines {
                if file.band.is_none_or(|only| only == band) {
                    *irradiance += given.irradiance_W_m2;
                }
            }
        }
    }
    sources.retain(|source| source.irradiance_W_m2.iter().any(|&value| value > 0.0));
    sources
}
