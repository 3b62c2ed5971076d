//! What a scene file says, checked as far as it can be without opening other files.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use toml::Spanned;

use super::super::error::FormatError;
use super::super::pattern::{Rectangle, refused};
use super::Text;
use super::tables::{
    BandTable, FaceTable, KindsTable, LightTable, LightText, MaterialTable, OneOrMany, PatternText,
    SceneFile, SkyTable, TimeText,
};
use crate::inputs::{BandInput, Inputs, KindsInput, LightInput, PatternInput};
use crate::light::photons::flat_spectrum_umol_J;
use crate::light::{SKY_NAMES, Sky, SkyModel, SunnySky};
use crate::optics::{AN_ALBEDO, FaceOptics, LeafOptics, is_albedo};

/// Paths become relative to what `folder` is relative to.
pub(super) fn inputs(
    file: SceneFile,
    text: &Text<'_>,
    folder: &Path,
) -> Result<Inputs, FormatError> {
    let scenes = match file.scene {
        None => Vec::new(),
        Some(OneOrMany::One(path)) => vec![folder.join(path)],
        Some(OneOrMany::Many(paths)) => paths.iter().map(|path| folder.join(path)).collect(),
    };
    if let Some(soil) = &file.soil
        && !soil.as_ref().is_finite()
    {
        return Err(text.fault(&soil.span(), "a finite soil height", soil.as_ref()));
    }
    if let Some(options) = &file.options {
        let checked = options.as_ref().check();
        checked.map_err(|fault| text.message(&options.span(), fault))?;
    }
    let pattern = file.pattern.map(|given| pattern(given, text, folder));
    let kinds = file.kinds.map(|given| kinds(given, text));
    let bands = file.bands.into_iter();
    let bands = bands.map(|given| band(given, text, folder));
    let (light, band_fraction) = match file.light {
        Some(given) => light(given, text, folder)?,
        None => (None, BTreeMap::new()),
    };
    Ok(Inputs {
        scenes,
        unit: file.unit,
        up: file.up,
        pattern: pattern.transpose()?,
        soil: file.soil.map(Spanned::into_inner),
        kinds: kinds.transpose()?.unwrap_or_default(),
        bands: bands.collect::<Result<_, _>>()?,
        light,
        band_fraction,
        options: file.options.map(Spanned::into_inner).unwrap_or_default(),
    })
}

fn pattern(
    given: Spanned<PatternText>,
    text: &Text<'_>,
    folder: &Path,
) -> Result<PatternInput, FormatError> {
    let span = given.span();
    match given.into_inner() {
        PatternText::File(path) => Ok(PatternInput::File(folder.join(path))),
        PatternText::Corners(corners) if Rectangle::from_corners(corners).is_some() => {
            Ok(PatternInput::Corners(corners))
        }
        PatternText::Corners(corners) => Err(refused(text.place(&span), corners)),
    }
}

fn kinds(given: Spanned<KindsTable>, text: &Text<'_>) -> Result<KindsInput, FormatError> {
    let span = given.span();
    let KindsTable { materials, species } = given.into_inner();
    let number = |given: String| match given.parse() {
        Ok(number) if number > 0 => Ok(number),
        _ => Err(text.fault(&span, "numbers from 1 for species", given)),
    };
    let species = species.into_iter();
    let species = species.map(|(given, kind)| Ok((number(given)?, kind)));
    Ok(KindsInput {
        materials,
        species: species.collect::<Result<_, FormatError>>()?,
    })
}

fn band(
    given: Spanned<BandTable>,
    text: &Text<'_>,
    folder: &Path,
) -> Result<BandInput, FormatError> {
    let place = text.place(&given.span());
    let band = given.into_inner();
    if let Some(albedo) = &band.soil_albedo {
        if band.optics.is_some() {
            return Err(text.fault(
                &albedo.span(),
                "the albedo of the soil in the optics file or here",
                "both",
            ));
        }
        if !is_albedo(*albedo.as_ref()) {
            return Err(text.fault(&albedo.span(), AN_ALBEDO, albedo.as_ref()));
        }
    }
    let photon_umol_J = photons(band.photon_umol_J, band.wavelengths_nm, text)?;
    let mut materials = BTreeMap::new();
    for (name, given) in band.materials {
        materials.insert(name, material(&given, text)?);
    }
    Ok(BandInput {
        name: band.name,
        optics: band.optics.map(|path| folder.join(path)),
        soil_albedo: band.soil_albedo.map(Spanned::into_inner),
        materials,
        photon_umol_J,
        place: Some(place),
    })
}

/// Photons of a joule, given or by wavelengths.
fn photons(
    factor: Option<Spanned<f64>>,
    wavelengths: Option<Spanned<[f64; 2]>>,
    text: &Text<'_>,
) -> Result<Option<f64>, FormatError> {
    match (factor, wavelengths) {
        (None, None) => Ok(None),
        (Some(factor), Some(_)) => {
            let expected = "either photon_umol_J or wavelengths_nm";
            Err(text.fault(&factor.span(), expected, "both"))
        }
        (Some(factor), None) => {
            let found = *factor.as_ref();
            if !(found > 0.0 && found <= MOST_UMOL_J) {
                let expected = "photons of a joule, above 0 to 1000 umol (4.57 is usual for PAR)";
                return Err(text.fault(&factor.span(), expected, found));
            }
            Ok(Some(found))
        }
        (None, Some(wavelengths)) => {
            let [from, to] = *wavelengths.as_ref();
            if !(from > 0.0 && from < to && to <= MOST_NM) {
                let expected =
                    "wavelengths in nm, from the shorter to the longer, above 0 to 100000";
                let found = format!("[{from}, {to}]");
                return Err(text.fault(&wavelengths.span(), expected, found));
            }
            Ok(Some(flat_spectrum_umol_J([from, to])))
        }
    }
}

/// Photons of a joule, µmol, at 120 µm: more is a mistake.
const MOST_UMOL_J: f64 = 1000.0;

/// The longest wavelength that is taken, nm: more is a mistake.
const MOST_NM: f64 = 100_000.0;

fn material(given: &Spanned<MaterialTable>, text: &Text<'_>) -> Result<LeafOptics, FormatError> {
    let face = |face: FaceTable| FaceOptics {
        rho: face.rho,
        tau: face.tau,
    };
    let optics = match *given.as_ref() {
        MaterialTable {
            rho: Some(rho),
            tau,
            upper: None,
            lower: None,
        } => LeafOptics::symmetric(rho, tau.unwrap_or(0.0)),
        MaterialTable {
            rho: None,
            tau: None,
            upper: Some(upper),
            lower: Some(lower),
        } => LeafOptics {
            upper: face(upper),
            lower: face(lower),
        },
        _ => {
            return Err(text.fault(
                &given.span(),
                "rho (and tau) of both faces, or upper and lower with rho (and tau) each",
                "another combination of these",
            ));
        }
    };
    let checked = optics.check();
    checked.map_err(|fault| text.message(&given.span(), fault))?;
    Ok(optics)
}

/// The light, if there is one, and the parts that bands have of weather.
type GivenLight = (Option<LightInput>, BTreeMap<String, f64>);

fn light(
    given: Spanned<LightText>,
    text: &Text<'_>,
    folder: &Path,
) -> Result<GivenLight, FormatError> {
    let span = given.span();
    let LightTable {
        files,
        sky,
        band_fraction,
    } = match given.into_inner() {
        LightText::File(path) => {
            let light = LightInput::File(folder.join(path));
            return Ok((Some(light), BTreeMap::new()));
        }
        LightText::Table(table) => table,
    };
    let refused = band_fraction
        .iter()
        .find(|(_, part)| !(**part > 0.0 && **part <= 1.0));
    if let Some((band, part)) = refused {
        let expected = format!("a part above 0 to 1 as band_fraction of {band}");
        return Err(text.fault(&span, expected, part));
    }
    let light = match (files, sky) {
        (Some(files), None) => {
            let files = files.into_iter();
            let files = files.map(|(band, path)| (band, folder.join(path)));
            Some(LightInput::Files(files.collect()))
        }
        (None, Some(given)) => Some(self::sky(given, &span, text)?),
        (None, None) if !band_fraction.is_empty() => None,
        _ => {
            let expected = "either [light.files] or [light.sky]";
            return Err(text.fault(&span, expected, "both or none"));
        }
    };
    if let Some(light) = &light {
        light.check().map_err(|fault| text.message(&span, fault))?;
    }
    Ok((light, band_fraction))
}

fn sky(given: SkyTable, span: &Range<usize>, text: &Text<'_>) -> Result<LightInput, FormatError> {
    let kind = given.kind.get_ref();
    let model: SkyModel = kind.parse().map_err(|_| {
        text.fault(
            &given.kind.span(),
            format!("kind of sky: {SKY_NAMES}"),
            kind,
        )
    })?;
    let irradiance_W_m2 = given.irradiance_W_m2;
    let when_and_where = (
        given.time_utc,
        given.latitude_deg,
        given.longitude_deg,
        given.diffuse_fraction,
    );
    let sunny = match (model, given.ghi_W_m2) {
        (SkyModel::Uniform | SkyModel::MoonSpencer, ghi) => {
            if ghi.is_some() || !matches!(when_and_where, (None, None, None, None)) {
                let expected = "irradiance_W_m2 alone for an overcast sky";
                return Err(text.fault(span, expected, "other keys too"));
            }
            let sky = match model {
                SkyModel::Uniform => Sky::UniformOvercast,
                _ => Sky::StandardOvercast,
            };
            return Ok(LightInput::Sky {
                sky,
                irradiance_W_m2,
            });
        }
        (SkyModel::Cie(kind), None) => SunnySky::Cie(kind),
        (SkyModel::Cie(_), Some(ghi)) => {
            let expected = "ghi_W_m2 with kind = \"perez\" alone";
            return Err(text.fault(span, expected, format!("{ghi} with another sky")));
        }
        (SkyModel::Perez, Some(global_W_m2)) => SunnySky::Perez { global_W_m2 },
        (SkyModel::Perez, None) => {
            let expected = "ghi_W_m2, the global irradiance of all wavelengths, for a sky of Perez";
            return Err(text.fault(span, expected, "none"));
        }
    };
    let (Some(time), Some(latitude_deg), Some(longitude_deg), Some(diffuse_fraction)) =
        when_and_where
    else {
        return Err(text.fault(
            span,
            format!(
                "time_utc, latitude_deg, longitude_deg and diffuse_fraction for the sky {model}"
            ),
            "only some of them",
        ));
    };
    let sky = Sky::Sunny {
        model: sunny,
        time_utc: match time {
            TimeText::Date(date) => date.to_string(),
            TimeText::Text(text) => text,
        },
        latitude_deg,
        longitude_deg,
        diffuse_fraction,
    };
    Ok(LightInput::Sky {
        sky,
        irradiance_W_m2,
    })
}
