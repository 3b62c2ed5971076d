//! Why no problem could be made of the inputs.

use thiserror::Error;

use super::sensors::SensorFault;
use crate::canopy::{MAX_NAME_BYTES, Organ};
use crate::formats::pattern::MIN_SIDE;
use crate::formats::{FormatError, MAX_COORDINATE, MAX_TRIANGLES, Place};
use crate::inputs::LightFault;
use crate::light::LightError;
use crate::light::sky::SkyError;
use crate::optics::OpticsFault;
use crate::options::OptionFault;

/// Why no problem could be made of the inputs.
#[derive(Debug, Error)]
pub enum LoadError {
    /// A file is not what its format asks for.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// An option is out of its range.
    #[error(transparent)]
    Option(#[from] OptionFault),
    /// The sky cannot be.
    #[error(transparent)]
    Light(#[from] LightFault),
    /// The light that results cannot be computed with.
    #[error(transparent)]
    Irradiance(#[from] LightError),
    /// There is no such sky at that time and place.
    #[error(transparent)]
    Sky(#[from] SkyError),
    /// Optical properties that did not come from a file are not physical.
    #[error("{material} in band {band}: {fault}")]
    Optics {
        /// The material.
        material: String,
        /// The band.
        band: String,
        /// What is wrong.
        fault: OpticsFault,
    },
    /// A sensor cannot be.
    #[error(transparent)]
    Sensor(#[from] SensorFault),
    /// Nothing says what is to be computed.
    #[error("expected {expected}, found none")]
    Missing {
        /// What there must be.
        expected: &'static str,
    },
    /// The geometry files hold no triangle.
    #[error("{files}: expected at least one triangle, found none")]
    EmptyScene {
        /// Their names.
        files: String,
    },
    /// Two files have an organ of the same name, which would be one row of the results.
    #[error(
        "{again}: {organ} is in {first} already; expected each organ in one file only: give plants or species of each file other numbers"
    )]
    OrganTwice {
        /// Where it is met again.
        again: Place,
        /// The organ.
        organ: Box<Organ>,
        /// Where it is met first.
        first: Place,
    },
    /// All geometry files together hold too much.
    #[error("{files}: expected at most {MAX_TRIANGLES} triangles, found {found}")]
    TooManyTriangles {
        /// Their names.
        files: String,
        /// How many triangles they hold.
        found: usize,
    },
    /// The scene uses a species that an `.opt` file does not have.
    #[error("{used}: species {species} is not in {opt_file}, which has {known} (band {band})")]
    UnknownSpecies {
        /// Where the species is first used.
        used: Place,
        /// Its number.
        species: u32,
        /// The file that should have it.
        opt_file: String,
        /// How many species that file has.
        known: usize,
        /// The band of the file.
        band: String,
    },
    /// The scene uses a material that a band says nothing of.
    #[error("{used}: material '{material}' has no optical properties in band {band}")]
    UnknownMaterial {
        /// Where the material is first used.
        used: Place,
        /// Its name.
        material: String,
        /// The band without it.
        band: String,
    },
    /// Soil that lets light through.
    #[error("{material} in band {band}: expected tau = 0, because it is declared to be soil")]
    ClearSoil {
        /// The material.
        material: String,
        /// The band.
        band: String,
    },
    /// There is soil, and a band without an albedo for it.
    #[error("band {band} has no soil albedo, but the scene has soil")]
    NoSoilAlbedo {
        /// The band.
        band: String,
    },
    /// Results could not be told apart.
    #[error(
        "expected band names that differ, of 1 to {MAX_NAME_BYTES} bytes, found '{name}' twice, empty or too long"
    )]
    BandName {
        /// The name.
        name: String,
    },
    /// Light per band must name exactly the bands there are.
    #[error("light is given for bands {given}, expected {expected}")]
    LightBands {
        /// As given.
        given: String,
        /// The bands of the scene.
        expected: String,
    },
    /// The height of the soil is no height.
    #[error(
        "soil height: expected a finite number within {MAX_COORDINATE:e} of zero, found {found}"
    )]
    SoilHeight {
        /// As given.
        found: f64,
    },
    /// The corners that were given span no area, or lie too far out.
    #[error(
        "pattern: expected corners {MIN_SIDE:e} or more apart in x and in y, in the file's unit and in metres, found {found}"
    )]
    Pattern {
        /// As given.
        found: String,
    },
    /// Parts that are too far from each other.
    #[error(
        "the scene, pattern and soil included, extends over {found:e} m, expected at most {MAX_COORDINATE:e} m"
    )]
    Extent {
        /// From the local origin, metres.
        found: f64,
    },
}
