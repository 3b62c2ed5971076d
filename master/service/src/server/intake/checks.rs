//! Materials, optics, sources and the pattern.

use std::collections::HashSet;
use std::fmt::Display;
use std::sync::Arc;

use glam::DVec3;
use nestrad_common::canopy::{Kind, MAX_NAME_BYTES};
use nestrad_common::formats::pattern::{MIN_SIDE, Rectangle};
use nestrad_common::light::perez::Perez;
use nestrad_common::light::radiance::{CIE_TYPES, CieType, Radiance};
use nestrad_common::light::{
    AN_IRRADIANCE, Light, MIN_DESCENT, POINTS_DOWN, SkyLight, Source, is_irradiance,
};
use nestrad_common::optics::{AN_ALBEDO, Band, FaceOptics, LeafOptics, Optics, is_albedo};
use nestrad_proto::v1;
use nestrad_proto::v1::scene_material::Kind as Sent;

use super::{ErrorCode, ServiceError, Surface};
use crate::server::held::Lighting;

const MAX_BANDS: usize = 256;
const MAX_MATERIALS: usize = 4096;
const MAX_SOURCES: usize = 65_536;

/// Optics and light for a canopy of these materials.
pub(in crate::server) fn lighting(
    header: &v1::SceneHeader,
    surfaces: &[Surface],
) -> Result<Lighting, ServiceError> {
    let v1::SceneHeader {
        bands,
        sources,
        sky,
        ..
    } = header;
    let length = |list: &str, found: usize, least: usize, most: usize| {
        let wanted = format_args!("{least} to {most}");
        let fits = (least..=most).contains(&found);
        fits.then_some(())
            .ok_or_else(|| ServiceError::invalid(list, wanted, found))
    };
    length("bands", bands.len(), 1, MAX_BANDS)?;
    length("sources", sources.len(), 0, MAX_SOURCES)?;
    let mut names = HashSet::new();
    let mut checked = Vec::with_capacity(bands.len());
    for (b, band) in bands.iter().enumerate() {
        name(format_args!("bands[{b}].name"), &band.name)?;
        if !names.insert(&band.name) {
            let place = format_args!("bands[{b}].name");
            let found = format_args!("'{}' again", band.name);
            return Err(ServiceError::invalid(place, "a name of its own", found));
        }
        checked.push(self::band(b, band, surfaces)?);
    }
    let sources = sources.iter().enumerate();
    let sources = sources.map(|(s, given)| source(s, given, bands.len()));
    let light = Light {
        suns: sources.collect::<Result<_, _>>()?,
        sky: sky
            .as_ref()
            .map(|given| self::sky(given, bands.len()))
            .transpose()?,
    };
    // what is checked above is said with its place; this is what files are held to
    let names = checked.iter().map(|band| band.name.as_str());
    light
        .check(names)
        .map_err(|error| ServiceError::new(ErrorCode::Invalid, error))?;
    Ok(Lighting {
        optics: Arc::new(Optics { bands: checked }),
        light: Arc::new(light),
    })
}

fn band(b: usize, given: &v1::BandOptics, surfaces: &[Surface]) -> Result<Band, ServiceError> {
    let soil_albedo = given.soil_albedo;
    if !is_albedo(soil_albedo) {
        let place = format_args!("bands[{b}].soil_albedo");
        return Err(ServiceError::invalid(place, AN_ALBEDO, soil_albedo));
    }
    if given.materials.len() != surfaces.len() {
        let place = format_args!("bands[{b}].materials");
        let wanted = format_args!("{}, one per material", surfaces.len());
        return Err(ServiceError::invalid(place, wanted, given.materials.len()));
    }
    let materials = given.materials.iter().zip(surfaces).enumerate();
    let materials = materials.map(|(m, (given, surface))| {
        let face = |rho, tau| FaceOptics { rho, tau };
        let optics = LeafOptics {
            upper: face(given.rho_upper, given.tau_upper),
            lower: face(given.rho_lower, given.tau_lower),
        };
        let place = format!("bands[{b}].materials[{m}]");
        if let Err(fault) = optics.check() {
            let wanted = "finite numbers of at least 0 with rho + tau <= 1";
            return Err(ServiceError::invalid(place, wanted, fault.values()));
        }
        if surface.is_opaque() && (given.tau_upper > 0.0 || given.tau_lower > 0.0) {
            let tau = given.tau_upper.max(given.tau_lower);
            return Err(ServiceError::invalid(
                place,
                "tau = 0 of soil and of what is solid",
                tau,
            ));
        }
        Ok(optics)
    });
    Ok(Band {
        name: given.name.clone(),
        soil_albedo,
        materials: materials.collect::<Result<_, _>>()?,
    })
}

/// Where a sky has its sun.
fn towards_sun(place: &'static str, given: Option<v1::Vector>) -> Result<DVec3, ServiceError> {
    let v1::Vector { x, y, z } = given.unwrap_or_default();
    let towards_sun = unit(DVec3::new(x, y, z));
    if !towards_sun.is_finite() || towards_sun.z < MIN_DESCENT {
        return Err(ServiceError::invalid(
            place,
            "a direction that points up, 0.0057 degrees above the horizon or more",
            format_args!("{x} {y} {z}"),
        ));
    }
    Ok(towards_sun)
}

fn sky(given: &v1::SkyLight, bands: usize) -> Result<SkyLight, ServiceError> {
    use v1::sky_light::Radiance as Given;
    let radiance = match &given.radiance {
        Some(Given::Uniform(_)) => Radiance::Uniform,
        Some(Given::MoonSpencer(_)) => Radiance::MoonSpencer,
        Some(Given::CieClear(clear)) => Radiance::Cie {
            kind: CieType::CLEAR,
            towards_sun: towards_sun("sky.cie_clear.towards_sun", clear.towards_sun)?,
        },
        Some(Given::Cie(cie)) => {
            let kind = u8::try_from(cie.r#type).ok().and_then(CieType::new);
            let invalid = || ServiceError::invalid("sky.cie.type", CIE_TYPES, cie.r#type);
            Radiance::Cie {
                kind: kind.ok_or_else(invalid)?,
                towards_sun: towards_sun("sky.cie.towards_sun", cie.towards_sun)?,
            }
        }
        // the ranges of the model are checked with the whole light
        Some(Given::Perez(perez)) => Radiance::Perez(Perez {
            towards_sun: towards_sun("sky.perez.towards_sun", perez.towards_sun)?,
            clearness: perez.clearness,
            brightness: perez.brightness,
        }),
        None => {
            let wanted = "uniform, moon_spencer, cie_clear, cie or perez";
            return Err(ServiceError::invalid("sky.radiance", wanted, "none"));
        }
    };
    let diffuse_fraction = given.diffuse_fraction;
    if !(diffuse_fraction > 0.0 && diffuse_fraction <= 1.0) {
        let (place, wanted) = ("sky.diffuse_fraction", "above 0 to 1");
        return Err(ServiceError::invalid(place, wanted, diffuse_fraction));
    }
    check_irradiance("sky", &given.irradiance_w_m2, bands)?;
    Ok(SkyLight {
        radiance,
        irradiance_W_m2: given.irradiance_w_m2.clone(),
        diffuse_fraction,
    })
}

/// One irradiance for each band.
fn check_irradiance(of: &str, given: &[f64], bands: usize) -> Result<(), ServiceError> {
    if given.len() != bands {
        let place = format_args!("{of}.irradiance_W_m2");
        let wanted = format_args!("{bands}, one per band");
        return Err(ServiceError::invalid(place, wanted, given.len()));
    }
    if let Some(b) = given.iter().position(|e| !is_irradiance(*e)) {
        return Err(ServiceError::invalid(
            format_args!("{of}.irradiance_W_m2[{b}]"),
            AN_IRRADIANCE,
            given[b],
        ));
    }
    Ok(())
}

fn source(s: usize, given: &v1::ParallelSource, bands: usize) -> Result<Source, ServiceError> {
    let of = &given.irradiance_w_m2;
    check_irradiance(&format!("sources[{s}]"), of, bands)?;
    let found = DVec3::new(given.direction_x, given.direction_y, given.direction_z);
    let direction = unit(found);
    if !direction.is_finite() || direction.z > -MIN_DESCENT {
        return Err(ServiceError::invalid(
            format_args!("sources[{s}]: direction"),
            POINTS_DOWN,
            format_args!("{} {} {}", found.x, found.y, found.z),
        ));
    }
    Ok(Source {
        direction,
        irradiance_W_m2: of.clone(),
    })
}

/// The direction with length 1. What has that length already keeps its bits: they come from another
/// nestrad, and would change with every rounding.
fn unit(given: DVec3) -> DVec3 {
    if (given.length_squared() - 1.0).abs() <= 8.0 * f64::EPSILON {
        return given;
    }
    // scaled first, so that lengths neither overflow nor vanish
    (given / given.abs().max_element()).normalize_or_zero()
}

/// The materials of a geometry.
pub(super) fn surfaces(given: &[v1::SceneMaterial]) -> Result<Vec<Surface>, ServiceError> {
    if !(1..=MAX_MATERIALS).contains(&given.len()) {
        let wanted = format_args!("1 to {MAX_MATERIALS}");
        return Err(ServiceError::invalid("materials", wanted, given.len()));
    }
    let mut names = HashSet::new();
    let mut surfaces = Vec::with_capacity(given.len());
    for (m, material) in given.iter().enumerate() {
        name(format_args!("materials[{m}].name"), &material.name)?;
        if !names.insert(&material.name) {
            let place = format_args!("materials[{m}].name");
            let found = format_args!("'{}' again", material.name);
            return Err(ServiceError::invalid(place, "a name of its own", found));
        }
        let kind = Sent::try_from(material.kind).map_err(|_| {
            let place = format_args!("materials[{m}].kind");
            ServiceError::invalid(place, "leaf, stem, soil or structure", material.kind)
        })?;
        let kind = match kind {
            Sent::Leaf => Kind::Leaf,
            Sent::Stem => Kind::Stem,
            Sent::Soil => Kind::Soil,
            Sent::Structure => Kind::Structure,
        };
        let is_solid = material.solid.unwrap_or(kind == Kind::Stem);
        if is_solid && kind == Kind::Structure {
            let place = format_args!("materials[{m}].solid");
            return Err(ServiceError::invalid(place, "false of a structure", "true"));
        }
        surfaces.push(Surface::new(m, &material.name, kind, is_solid));
    }
    Ok(surfaces)
}

/// The pattern of a geometry.
pub(super) fn pattern(given: &v1::PatternRectangle) -> Result<Rectangle, ServiceError> {
    let corners = [given.min_x_m, given.min_y_m, given.max_x_m, given.max_y_m];
    let proper = given.min_x_m < given.max_x_m && given.min_y_m < given.max_y_m;
    let rectangle = Rectangle::from_corners(corners).filter(|_| proper);
    rectangle.ok_or_else(|| {
        let wanted = format_args!("finite corners, min below max by {MIN_SIDE:e} m or more");
        let found = corners.map(|value| value.to_string()).join(" ");
        ServiceError::invalid("pattern", wanted, found)
    })
}

/// A name that messages and tables can carry.
pub(super) fn name(place: impl Display, text: &str) -> Result<(), ServiceError> {
    if text.is_empty() || text.len() > MAX_NAME_BYTES {
        let wanted = format_args!("1 to {MAX_NAME_BYTES} bytes");
        return Err(ServiceError::invalid(place, wanted, text.len()));
    }
    Ok(())
}
