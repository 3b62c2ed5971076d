//! `.opt`: the optical properties of soil and species in one band.
//!
//! `n SPECIES`, `s d SOIL_ALBEDO`, and one line per species, in order from 1:
//! `e d STEM_RHO  d UPPER_RHO UPPER_TAU  d LOWER_RHO LOWER_TAU`.

use super::error::FormatError;
use super::lines::{Fields, Lines};
use crate::optics::{FaceOptics, LeafOptics};
use crate::scene::Material;

/// What an `.opt` file holds; all of it physical.
#[derive(Clone, Debug, PartialEq)]
pub struct Opt {
    /// The file as the user named it.
    pub file: String,
    /// Albedo of the soil, 0 to 1.
    pub soil_albedo: f64,
    /// Species 1, 2, ...
    pub species: Vec<Species>,
}

/// The optical properties of a species in one band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Species {
    /// Of its opaque parts.
    pub stem: LeafOptics,
    /// Of its leaves.
    pub leaf: LeafOptics,
}

impl Opt {
    /// The properties of a material; `None` for a species that the file does not have and for
    /// materials with a name, which no `.opt` file has.
    pub fn material(&self, material: &Material) -> Option<LeafOptics> {
        let species = |number: u32| self.species.get((number as usize).checked_sub(1)?);
        match material {
            Material::Stem { species: number } => species(*number).map(|species| species.stem),
            Material::Leaf { species: number } => species(*number).map(|species| species.leaf),
            Material::Soil => Some(LeafOptics::opaque(self.soil_albedo)),
            Material::Named(_) => None,
        }
    }
}

/// Parses an `.opt` file; `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Opt, FormatError> {
    let mut announced = None;
    let mut soil_albedo = None;
    let mut species = Vec::new();
    let mut lines = Lines::new(file, bytes);
    while let Some(mut fields) = lines.next()? {
        match fields.required("'n', 's' or 'e'")? {
            b"n" if announced.is_none() => {
                announced = Some(fields.count("a number of species")?);
            }
            b"s" if soil_albedo.is_none() => {
                fields.keyword("d")?;
                let soil = opaque(&mut fields, "the albedo of the soil")?;
                soil_albedo = Some(soil.upper.rho);
            }
            b"e" => species.push(self::species(&mut fields)?),
            other => {
                return Err(fields.fault("one line 'n', one line 's' and lines 'e'", Some(other)));
            }
        }
        fields.end()?;
    }
    let announced = announced.ok_or_else(|| lines.missing("'n' and the number of species"))?;
    let soil_albedo = soil_albedo.ok_or_else(|| lines.missing("'s d' and the soil's albedo"))?;
    if species.len() != announced {
        let found = species.len();
        return Err(lines.missing(format_args!(
            "as many lines 'e' as line 'n' says, {announced}, not {found}"
        )));
    }
    Ok(Opt {
        file: file.to_owned(),
        soil_albedo,
        species,
    })
}

fn species(fields: &mut Fields<'_>) -> Result<Species, FormatError> {
    fields.keyword("d")?;
    let stem = opaque(fields, "rho of the stem")?;
    let leaf = LeafOptics {
        upper: face(fields, "upper")?,
        lower: face(fields, "lower")?,
    };
    checked(fields, leaf)?;
    Ok(Species { stem, leaf })
}

fn face(fields: &mut Fields<'_>, which: &str) -> Result<FaceOptics, FormatError> {
    fields.keyword("d")?;
    Ok(FaceOptics {
        rho: fields.number(format_args!("rho of the leaf's {which} face"))?,
        tau: fields.number(format_args!("tau of the leaf's {which} face"))?,
    })
}

fn opaque(fields: &mut Fields<'_>, what: &str) -> Result<LeafOptics, FormatError> {
    let optics = LeafOptics::opaque(fields.number(what)?);
    checked(fields, optics)?;
    Ok(optics)
}

fn checked(fields: &Fields<'_>, optics: LeafOptics) -> Result<(), FormatError> {
    optics.check().map_err(|fault| FormatError::Content {
        place: fields.place(),
        expected: "rho and tau of at least 0, and rho + tau of at most 1".to_owned(),
        found: fault.values(),
    })
}
