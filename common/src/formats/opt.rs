//! `.opt`: the optical properties of soil and species in one band.
//!
//! `n SPECIES`, `s d SOIL_ALBEDO`, and one line per species, in order from 1:
//! `e d STEM_RHO  d UPPER_RHO UPPER_TAU  d LOWER_RHO LOWER_TAU`.

use super::error::FormatError;
use super::lines::{Fields, Lines};
use crate::canopy::Material;
use crate::optics::{FaceOptics, LeafOptics};

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
        return Err(FormatError::Content {
            place: lines.place(),
            expected: format!("as many lines 'e' as line 'n' says, {announced}"),
            found: species.len().to_string(),
        });
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

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: &str = "# a comment\nn 2 # two\ns d 0.15\n\
                       e d 0.12   d 0.09 0.05   d 0.11 0.04\ne d 0.2 d 0.3 0.7 d 0 0";

    fn refusal(text: &str) -> String {
        parse("a.opt", text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn both_faces_of_every_species_are_read() {
        let opt = parse("a.opt", TWO.as_bytes()).unwrap();
        assert_eq!(opt.soil_albedo, 0.15);
        let leaf = opt.material(&Material::Leaf { species: 1 }).unwrap();
        assert_eq!((leaf.upper.rho, leaf.upper.tau), (0.09, 0.05));
        assert_eq!((leaf.lower.rho, leaf.lower.tau), (0.11, 0.04));
        let stem = opt.material(&Material::Stem { species: 2 });
        assert_eq!(stem, Some(LeafOptics::opaque(0.2)));
        assert_eq!(
            opt.material(&Material::Soil),
            Some(LeafOptics::opaque(0.15))
        );
        for unknown in [0, 3, u32::MAX] {
            assert_eq!(opt.material(&Material::Leaf { species: unknown }), None);
        }
    }

    #[test]
    fn fault_equal_rho_and_tau_and_no_reflection_are_no_faults() {
        let text = "n 2\ns d 0\ne d 0 d 0.3 0.3 d 0.3 0.3\ne d 0 d 0 0.5 d 0 0.5\n";
        assert_eq!(parse("a.opt", text.as_bytes()).unwrap().species.len(), 2);
    }

    #[test]
    fn unphysical_optics_are_refused_with_their_line() {
        assert_eq!(
            refusal(&TWO.replace("0.3 0.7", "0.31 0.7")),
            "a.opt, line 5: expected rho and tau of at least 0, and rho + tau of at most 1, \
             found rho = 0.31 and tau = 0.7"
        );
        for (from, to, line) in [
            ("0.15", "-0.15", 3),
            ("0.15", "1.5", 3),
            ("0.12", "1.01", 4),
            ("0.09 0.05", "0.09 -0.05", 4),
            ("0.11 0.04", "nan 0.04", 4),
        ] {
            let error = refusal(&TWO.replace(from, to));
            assert!(
                error.starts_with(&format!("a.opt, line {line}: ")),
                "{error}"
            );
        }
    }

    #[test]
    fn what_is_missing_or_too_much_is_named() {
        for (text, expected) in [
            (
                "",
                "a.opt, line 1: expected 'n' and the number of species, found the end of the file",
            ),
            (
                "n 0",
                "a.opt, line 1: expected 's d' and the soil's albedo, found the end of the file",
            ),
            (
                "n 2\ns d 0\ne d 0 d 0 0 d 0 0\n",
                "a.opt, line 3: expected as many lines 'e' as line 'n' says, 2, found 1",
            ),
            (
                "n 18446744073709551615\ns d 0\n",
                "a.opt, line 2: expected as many lines 'e' as line 'n' says, 18446744073709551615, found 0",
            ),
            (
                "s d 0\ns d 0\n",
                "a.opt, line 2: expected one line 'n', one line 's' and lines 'e', found 's'",
            ),
            ("s 0.1", "a.opt, line 1: expected 'd', found '0.1'"),
            (
                "n 1\ne d 0.1 d 0.1 0.1 d 0.1\n",
                "a.opt, line 2: expected tau of the leaf's lower face, a finite number, found the end of the line",
            ),
            (
                "n 1 1\n",
                "a.opt, line 1: expected the end of the line, found '1'",
            ),
        ] {
            assert_eq!(refusal(text), expected);
        }
    }
}
