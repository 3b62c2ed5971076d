//! `scene.toml`: all that a solve needs, in one file.
//!
//! ```toml
//! scene = "maize.can.gz"              # or a list of files
//! unit = "m"                          # of geometry, pattern and soil
//! pattern = "maize.8"                 # or [x0, y0, x1, y1]
//! soil = -0.002
//! light = "clear.light"
//!
//! [[bands]]
//! name = "PAR"
//! optics = "par.opt"
//!
//! [[bands]]
//! name = "NIR"
//! soil_albedo = 0.25
//! [bands.materials]
//! bark = { rho = 0.4 }
//! leaf = { upper = { rho = 0.44, tau = 0.45 }, lower = { rho = 0.46, tau = 0.44 } }
//!
//! [options]
//! accuracy_percent = 0.5
//! ```
//!
//! In place of `light = "FILE"`: `[light.files]`, with one `.light` file for each band's name, or
//! `[light.sky]` with `kind = "uniform_overcast"`, `"standard_overcast"` or `"clear"`,
//! `irradiance_W_m2 = { PAR = 400.0, NIR = 380.0 }`, and for a clear sky `time_utc`, `latitude_deg`,
//! `longitude_deg`, `diffuse_fraction`. Paths are relative to the scene file.

use std::collections::BTreeMap;
use std::fmt::Display;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Spanned;

use super::error::{FormatError, Place};
use super::pattern::{Rectangle, refused};
use crate::inputs::{BandInput, Inputs, LightInput, PatternInput};
use crate::light::Sky;
use crate::optics::{FaceOptics, LeafOptics};
use crate::options::{Options, Unit};

/// Parses a scene file; `file` is its name in messages, `folder` what its paths are relative to.
pub fn parse(file: &str, bytes: &[u8], folder: &Path) -> Result<Inputs, FormatError> {
    let text = Text::new(file, bytes)?;
    let raw: SceneFile = toml::from_str(text.text).map_err(|error| FormatError::Toml {
        place: error
            .span()
            .map_or_else(|| Place::file(file), |span| text.place(&span)),
        message: error.message().replace('\n', ", "),
    })?;
    raw.checked(&text, folder)
}

/// The text, to turn positions into line numbers.
struct Text<'a> {
    file: &'a str,
    text: &'a str,
}

impl<'a> Text<'a> {
    fn new(file: &'a str, bytes: &'a [u8]) -> Result<Self, FormatError> {
        match std::str::from_utf8(bytes) {
            Ok(text) => Ok(Self { file, text }),
            Err(error) => {
                let line = line_of(bytes, error.valid_up_to());
                Err(FormatError::Content {
                    place: Place::line(file, line),
                    expected: "UTF-8 text".to_owned(),
                    found: "other bytes".to_owned(),
                })
            }
        }
    }

    fn place(&self, span: &Range<usize>) -> Place {
        Place::line(self.file, line_of(self.text.as_bytes(), span.start))
    }

    fn fault(
        &self,
        span: &Range<usize>,
        expected: impl Display,
        found: impl Display,
    ) -> FormatError {
        FormatError::Content {
            place: self.place(span),
            expected: expected.to_string(),
            found: found.to_string(),
        }
    }
}

fn line_of(bytes: &[u8], position: usize) -> usize {
    let before = &bytes[..position.min(bytes.len())];
    1 + before.iter().filter(|&&byte| byte == b'\n').count()
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    scene: Option<OneOrMany>,
    unit: Option<Unit>,
    pattern: Option<Spanned<PatternText>>,
    soil: Option<Spanned<f64>>,
    #[serde(default)]
    bands: Vec<Spanned<BandTable>>,
    light: Option<Spanned<LightText>>,
    #[serde(default)]
    options: Option<Spanned<Options>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a file or a list of files")]
enum OneOrMany {
    One(PathBuf),
    Many(Vec<PathBuf>),
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a file or [x0, y0, x1, y1]")]
enum PatternText {
    File(PathBuf),
    Corners([f64; 4]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BandTable {
    name: String,
    optics: Option<PathBuf>,
    soil_albedo: Option<Spanned<f64>>,
    #[serde(default)]
    materials: BTreeMap<String, Spanned<MaterialTable>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct FaceTable {
    rho: f64,
    #[serde(default)]
    tau: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialTable {
    rho: Option<f64>,
    tau: Option<f64>,
    upper: Option<FaceTable>,
    lower: Option<FaceTable>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a file, [light.files] or [light.sky]")]
enum LightText {
    File(PathBuf),
    Table(LightTable),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LightTable {
    files: Option<BTreeMap<String, PathBuf>>,
    sky: Option<SkyTable>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum SkyKind {
    UniformOvercast,
    StandardOvercast,
    Clear,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SkyTable {
    kind: SkyKind,
    irradiance_W_m2: BTreeMap<String, f64>,
    time_utc: Option<TimeText>,
    latitude_deg: Option<f64>,
    longitude_deg: Option<f64>,
    diffuse_fraction: Option<f64>,
}

/// TOML has dates of its own; quotes around one are as good.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a date and time")]
enum TimeText {
    Date(toml::value::Datetime),
    Text(String),
}

impl SceneFile {
    fn checked(self, text: &Text<'_>, folder: &Path) -> Result<Inputs, FormatError> {
        let scenes = match self.scene {
            None => Vec::new(),
            Some(OneOrMany::One(path)) => vec![folder.join(path)],
            Some(OneOrMany::Many(paths)) => paths.iter().map(|path| folder.join(path)).collect(),
        };
        if let Some(soil) = &self.soil
            && !soil.as_ref().is_finite()
        {
            return Err(text.fault(&soil.span(), "a finite soil height", soil.as_ref()));
        }
        if let Some(options) = &self.options {
            let checked = options.as_ref().check();
            checked.map_err(|fault| FormatError::Toml {
                place: text.place(&options.span()),
                message: fault.to_string(),
            })?;
        }
        let bands = self.bands.into_iter();
        Ok(Inputs {
            scenes,
            unit: self.unit,
            pattern: self
                .pattern
                .map(|pattern| checked_pattern(pattern, text, folder))
                .transpose()?,
            soil: self.soil.map(Spanned::into_inner),
            bands: bands
                .map(|band| checked_band(band, text, folder))
                .collect::<Result<_, _>>()?,
            light: self
                .light
                .map(|light| checked_light(light, text, folder))
                .transpose()?,
            options: self.options.map(Spanned::into_inner).unwrap_or_default(),
        })
    }
}

fn checked_pattern(
    pattern: Spanned<PatternText>,
    text: &Text<'_>,
    folder: &Path,
) -> Result<PatternInput, FormatError> {
    let span = pattern.span();
    match pattern.into_inner() {
        PatternText::File(path) => Ok(PatternInput::File(folder.join(path))),
        PatternText::Corners(corners) if Rectangle::from_corners(corners).is_some() => {
            Ok(PatternInput::Corners(corners))
        }
        PatternText::Corners(corners) => Err(refused(text.place(&span), corners)),
    }
}

fn checked_band(
    band: Spanned<BandTable>,
    text: &Text<'_>,
    folder: &Path,
) -> Result<BandInput, FormatError> {
    let place = text.place(&band.span());
    let band = band.into_inner();
    if let Some(albedo) = &band.soil_albedo {
        if band.optics.is_some() {
            return Err(text.fault(
                &albedo.span(),
                "the albedo of the soil in the optics file or here",
                "both",
            ));
        }
        if !(0.0..=1.0).contains(albedo.as_ref()) {
            return Err(text.fault(&albedo.span(), "an albedo from 0 to 1", albedo.as_ref()));
        }
    }
    let mut materials = BTreeMap::new();
    for (name, material) in band.materials {
        materials.insert(name, checked_material(&material, text)?);
    }
    Ok(BandInput {
        name: band.name,
        optics: band.optics.map(|path| folder.join(path)),
        soil_albedo: band.soil_albedo.map(Spanned::into_inner),
        materials,
        place: Some(place),
    })
}

fn checked_material(
    material: &Spanned<MaterialTable>,
    text: &Text<'_>,
) -> Result<LeafOptics, FormatError> {
    let face = |face: FaceTable| FaceOptics {
        rho: face.rho,
        tau: face.tau,
    };
    let optics = match *material.as_ref() {
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
                &material.span(),
                "rho and tau of both faces, or upper and lower with rho and tau each",
                "something else",
            ));
        }
    };
    optics.check().map_err(|fault| {
        text.fault(
            &material.span(),
            "rho and tau of at least 0, and rho + tau of at most 1",
            fault.values(),
        )
    })?;
    Ok(optics)
}

fn checked_light(
    light: Spanned<LightText>,
    text: &Text<'_>,
    folder: &Path,
) -> Result<LightInput, FormatError> {
    let span = light.span();
    match light.into_inner() {
        LightText::File(path) => Ok(LightInput::File(folder.join(path))),
        LightText::Table(LightTable {
            files: Some(files),
            sky: None,
        }) => Ok(LightInput::Files(
            files
                .into_iter()
                .map(|(band, path)| (band, folder.join(path)))
                .collect(),
        )),
        LightText::Table(LightTable {
            files: None,
            sky: Some(sky),
        }) => checked_sky(sky, &span, text),
        LightText::Table(_) => {
            Err(text.fault(&span, "either [light.files] or [light.sky]", "both or none"))
        }
    }
}

fn checked_sky(
    sky: SkyTable,
    span: &Range<usize>,
    text: &Text<'_>,
) -> Result<LightInput, FormatError> {
    for (band, irradiance) in &sky.irradiance_W_m2 {
        if !(irradiance.is_finite() && *irradiance >= 0.0) {
            let expected = format!("an irradiance of at least 0 in band {band}");
            return Err(text.fault(span, expected, irradiance));
        }
    }
    let place_and_time = (
        sky.time_utc,
        sky.latitude_deg,
        sky.longitude_deg,
        sky.diffuse_fraction,
    );
    let kind = match (sky.kind, place_and_time) {
        (SkyKind::UniformOvercast, (None, None, None, None)) => Sky::UniformOvercast,
        (SkyKind::StandardOvercast, (None, None, None, None)) => Sky::StandardOvercast,
        (SkyKind::Clear, (Some(time), Some(latitude), Some(longitude), Some(diffuse))) => {
            for (name, value, range) in [
                ("latitude_deg", latitude, -90.0..=90.0),
                ("longitude_deg", longitude, -180.0..=180.0),
                ("diffuse_fraction", diffuse, 0.0..=1.0),
            ] {
                if !range.contains(&value) {
                    let expected = format!("{name} from {} to {}", range.start(), range.end());
                    return Err(text.fault(span, expected, value));
                }
            }
            Sky::Clear {
                time_utc: match time {
                    TimeText::Date(date) => date.to_string(),
                    TimeText::Text(text) => text,
                },
                latitude_deg: latitude,
                longitude_deg: longitude,
                diffuse_fraction: diffuse,
            }
        }
        _ => {
            return Err(text.fault(
                span,
                "time_utc, latitude_deg, longitude_deg and diffuse_fraction for a clear sky, none of them for others",
                "another choice of them",
            ));
        }
    };
    Ok(LightInput::Sky {
        sky: kind,
        irradiance_W_m2: sky.irradiance_W_m2,
    })
}
