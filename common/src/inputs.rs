//! What to load: the same for the command line and for a scene file.

use std::collections::BTreeMap;
use std::path::PathBuf;

use thiserror::Error;

use crate::canopy::Kind;
use crate::formats::Place;
use crate::light::sun::{Sun, SunError};
use crate::light::{AN_IRRADIANCE, MOST_GLOBAL_W_M2, Sky, SunnySky, is_irradiance};
use crate::optics::LeafOptics;
use crate::options::{Options, Unit, Up};

/// The files and values that make a problem. Anything may be missing here; [`crate::assemble::load`]
/// says what must be there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Geometry: `.obj` and `.obj.gz` are Wavefront OBJ, all else is CAN.
    pub scenes: Vec<PathBuf>,
    /// Of geometry, pattern and soil height; metres where it is not given.
    pub unit: Option<Unit>,
    /// The axis of the geometry files that points up; z where it is not given. Pattern, soil and light have z up.
    pub up: Option<Up>,
    /// Where the canopy repeats; `None` for an isolated scene.
    pub pattern: Option<PatternInput>,
    /// Height of the soil plane in `unit`; `None` for a black void below.
    pub soil: Option<f64>,
    /// What counts as what.
    pub kinds: KindsInput,
    /// In the order of the results.
    pub bands: Vec<BandInput>,
    /// The light above the canopy.
    pub light: Option<LightInput>,
    /// Which part of broadband irradiance each band gets, by its name, for weather: above 0 to 1.
    pub band_fraction: BTreeMap<String, f64>,
    /// How to solve.
    pub options: Options,
}

impl Inputs {
    /// These inputs where they say something, the others elsewhere: flags over a scene file.
    /// Lists (scenes, bands) are taken as a whole from one or the other.
    #[must_use]
    pub fn over(self, other: Self) -> Self {
        let first = |mine: Vec<PathBuf>, theirs| if mine.is_empty() { theirs } else { mine };
        Self {
            scenes: first(self.scenes, other.scenes),
            unit: self.unit.or(other.unit),
            up: self.up.or(other.up),
            pattern: self.pattern.or(other.pattern),
            soil: self.soil.or(other.soil),
            kinds: if self.kinds == KindsInput::default() {
                other.kinds
            } else {
                self.kinds
            },
            bands: if self.bands.is_empty() {
                other.bands
            } else {
                self.bands
            },
            light: self.light.or(other.light),
            band_fraction: if self.band_fraction.is_empty() {
                other.band_fraction
            } else {
                self.band_fraction
            },
            options: self.options.over(other.options),
        }
    }
}

/// The pattern, from a file or as two corners.
#[derive(Clone, Debug, PartialEq)]
pub enum PatternInput {
    /// A `.8` file.
    File(PathBuf),
    /// x y and x y of two opposite corners.
    Corners([f64; 4]),
}

/// What surfaces count as, where it is not what their file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KindsInput {
    /// Materials by name (OBJ).
    pub materials: BTreeMap<String, Kind>,
    /// All of a CAN species, by its number.
    pub species: BTreeMap<u32, Kind>,
}

/// A wavelength band and where its optical properties are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BandInput {
    /// The user's name for it.
    pub name: String,
    /// An `.opt` file: soil and CAN species.
    pub optics: Option<PathBuf>,
    /// Albedo of the soil, 0 to 1, where it is not the file's.
    pub soil_albedo: Option<f64>,
    /// Materials by name (OBJ).
    pub materials: BTreeMap<String, LeafOptics>,
    /// Photons of a joule, µmol, where they were given or follow from wavelengths.
    pub photon_umol_J: Option<f64>,
    /// Where the band is written down, if in a scene file.
    pub place: Option<Place>,
}

/// The light, from files or as a sky.
#[derive(Clone, Debug, PartialEq)]
pub enum LightInput {
    /// One `.light` file, the same irradiance in all bands.
    File(PathBuf),
    /// A `.light` file per band, by the band's name.
    Files(BTreeMap<String, PathBuf>),
    /// A sky, with the irradiance of the horizontal (W m⁻²) by the band's name.
    Sky {
        /// How its light is distributed.
        sky: Sky,
        /// One for every band.
        irradiance_W_m2: BTreeMap<String, f64>,
    },
}

impl LightInput {
    /// Refuses a sky that cannot be. Files are checked as they are read.
    pub fn check(&self) -> Result<(), LightFault> {
        let Self::Sky {
            sky,
            irradiance_W_m2,
        } = self
        else {
            return Ok(());
        };
        for (band, &found) in irradiance_W_m2 {
            if !is_irradiance(found) {
                let band = band.clone();
                return Err(LightFault::Irradiance { band, found });
            }
        }
        let Sky::Sunny {
            model,
            time_utc,
            latitude_deg,
            longitude_deg,
            diffuse_fraction,
        } = sky
        else {
            return Ok(());
        };
        let global_W_m2 = match *model {
            SunnySky::Perez { global_W_m2 } => global_W_m2,
            SunnySky::Cie(_) => MOST_GLOBAL_W_M2,
        };
        for (value, found, low, high) in [
            ("ghi_W_m2", global_W_m2, 1.0, MOST_GLOBAL_W_M2),
            ("latitude_deg", *latitude_deg, -90.0, 90.0),
            ("longitude_deg", *longitude_deg, -180.0, 180.0),
            ("diffuse_fraction", *diffuse_fraction, 0.0, 1.0),
        ] {
            if !(low..=high).contains(&found) {
                return Err(LightFault::Range {
                    value,
                    low,
                    high,
                    found,
                });
            }
        }
        Sun::at(time_utc, *latitude_deg, *longitude_deg)?;
        Ok(())
    }
}

/// Why a sky was refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LightFault {
    /// Less than no light, or no number.
    #[error("irradiance in band {band}: expected {AN_IRRADIANCE}, found {found:e}")]
    Irradiance {
        /// The band's name.
        band: String,
        /// As given, W m⁻².
        found: f64,
    },
    /// A value that is nowhere on earth, or no fraction.
    #[error("{value}: expected {low} to {high}, found {found}")]
    Range {
        /// Its name.
        value: &'static str,
        /// The least it may be.
        low: f64,
        /// The most it may be.
        high: f64,
        /// As given.
        found: f64,
    },
    /// There is no sun at that time and place.
    #[error(transparent)]
    Sun(#[from] SunError),
}
