//! Optical properties for the materials that a scene has.

use std::collections::BTreeMap;

use super::{LoadError, name};
use crate::canopy::{Canopy, Kind, Material};
use crate::formats::opt::{Opt, parse};
use crate::formats::read::{SMALL, read};
use crate::formats::{Origins, Place};
use crate::inputs::BandInput;
use crate::optics::{Band, LeafOptics};

/// All that is known of a band, before it is asked for the materials of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BandOptics {
    /// The user's name for the band.
    pub name: String,
    /// Soil and CAN species.
    pub opt: Option<Opt>,
    /// Albedo of the soil, 0 to 1, if there is no `opt`.
    pub soil_albedo: Option<f64>,
    /// Materials by name.
    pub materials: BTreeMap<String, LeafOptics>,
    /// Where the band is written down, if in a scene file.
    pub place: Option<Place>,
}

impl BandOptics {
    pub(super) fn read(band: &BandInput) -> Result<Self, LoadError> {
        let opt = match &band.optics {
            Some(path) => Some(parse(&name(path), &read(path, SMALL, "optics (.opt)")?)?),
            None => None,
        };
        Ok(Self {
            name: band.name.clone(),
            opt,
            soil_albedo: band.soil_albedo,
            materials: band.materials.clone(),
            place: band.place.clone(),
        })
    }

    fn soil_albedo(&self) -> Option<f64> {
        let of_file = self.opt.as_ref().map(|opt| opt.soil_albedo);
        of_file.or(self.soil_albedo)
    }

    fn material(
        &self,
        material: &Material,
        used: impl FnOnce() -> Place,
    ) -> Result<LeafOptics, LoadError> {
        let found = match material {
            Material::Named(name) => self.materials.get(name).copied(),
            Material::Soil => self.soil_albedo().map(LeafOptics::opaque),
            Material::Stem { .. } | Material::Leaf { .. } => {
                self.opt.as_ref().and_then(|opt| opt.material(material))
            }
        };
        let Some(optics) = found else {
            return Err(self.unknown(material, used()));
        };
        optics.check().map_err(|fault| LoadError::Optics {
            material: material.to_string(),
            band: self.title(),
            fault,
        })?;
        Ok(optics)
    }

    fn unknown(&self, material: &Material, used: Place) -> LoadError {
        match (material, &self.opt) {
            (Material::Soil, _) => self.no_albedo(),
            (Material::Stem { species } | Material::Leaf { species }, Some(opt)) => {
                LoadError::UnknownSpecies {
                    used,
                    species: *species,
                    opt_file: opt.file.clone(),
                    known: opt.species.len(),
                    band: self.title(),
                }
            }
            _ => LoadError::UnknownMaterial {
                used,
                material: material.to_string(),
                band: self.title(),
            },
        }
    }

    /// The name for messages, with the line of the scene file if it is in one.
    fn title(&self) -> String {
        match &self.place {
            Some(place) => format!("{} ({place})", self.name),
            None => self.name.clone(),
        }
    }

    fn no_albedo(&self) -> LoadError {
        LoadError::NoSoilAlbedo { band: self.title() }
    }
}

/// The band for the materials of a canopy. The albedo of soil that does not exist is 0.
pub fn resolve_band(
    optics: BandOptics,
    canopy: &Canopy,
    origins: &Origins,
) -> Result<Band, LoadError> {
    let materials = (0..).zip(&canopy.materials).zip(canopy.kinds());
    let materials = materials
        .map(|((index, material), kind)| {
            let found = optics.material(material, || origins.first_use(canopy, index))?;
            if kind == Kind::Soil && found.upper.tau + found.lower.tau > 0.0 {
                let (material, band) = (material.to_string(), optics.title());
                return Err(LoadError::ClearSoil { material, band });
            }
            Ok(found)
        })
        .collect::<Result<_, _>>()?;
    let soil_albedo = match canopy.soil_z_m {
        Some(_) => optics.material(&Material::Soil, Place::default)?.upper.rho,
        None => optics.soil_albedo().unwrap_or(0.0),
    };
    Ok(Band {
        name: optics.name,
        soil_albedo,
        materials,
    })
}
