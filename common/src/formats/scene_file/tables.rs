//! The tables of a scene file as they are written, before anything is checked.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, Deserializer, MapAccess, Visitor};
use toml::Spanned;

use crate::canopy::Kind;
use crate::options::{Options, Unit, Up};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub(super) scene: Option<OneOrMany>,
    pub(super) unit: Option<Unit>,
    pub(super) up: Option<Up>,
    pub(super) pattern: Option<Spanned<PatternText>>,
    pub(super) soil: Option<Spanned<f64>>,
    pub(super) kinds: Option<Spanned<KindsTable>>,
    #[serde(default)]
    pub(super) bands: Vec<Spanned<BandTable>>,
    pub(super) light: Option<Spanned<LightText>>,
    #[serde(default)]
    pub(super) options: Option<Spanned<Options>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a file or a list of files")]
pub(super) enum OneOrMany {
    One(PathBuf),
    Many(Vec<PathBuf>),
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a file or [x0, y0, x1, y1]")]
pub(super) enum PatternText {
    File(PathBuf),
    Corners([f64; 4]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct KindsTable {
    #[serde(default)]
    pub(super) materials: BTreeMap<String, Kind>,
    /// Keys of a TOML table are text.
    #[serde(default)]
    pub(super) species: BTreeMap<String, Kind>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BandTable {
    pub(super) name: String,
    pub(super) optics: Option<PathBuf>,
    pub(super) soil_albedo: Option<Spanned<f64>>,
    pub(super) photon_umol_J: Option<Spanned<f64>>,
    pub(super) wavelengths_nm: Option<Spanned<[f64; 2]>>,
    #[serde(default)]
    pub(super) materials: BTreeMap<String, Spanned<MaterialTable>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FaceTable {
    pub(super) rho: f64,
    #[serde(default)]
    pub(super) tau: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MaterialTable {
    pub(super) rho: Option<f64>,
    pub(super) tau: Option<f64>,
    pub(super) upper: Option<FaceTable>,
    pub(super) lower: Option<FaceTable>,
}

/// Told apart by hand: serde's untagged enums would not say which field of a table is wrong.
pub(super) enum LightText {
    File(PathBuf),
    Table(LightTable),
}

impl<'de> Deserialize<'de> for LightText {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = LightText;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a file, [light.files] or [light.sky]")
            }

            fn visit_str<E: de::Error>(self, path: &str) -> Result<LightText, E> {
                Ok(LightText::File(path.into()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<LightText, A::Error> {
                LightTable::deserialize(MapAccessDeserializer::new(map)).map(LightText::Table)
            }
        }

        deserializer.deserialize_any(Either)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LightTable {
    pub(super) files: Option<BTreeMap<String, PathBuf>>,
    pub(super) sky: Option<SkyTable>,
    #[serde(default)]
    pub(super) band_fraction: BTreeMap<String, f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SkyTable {
    pub(super) kind: Spanned<String>,
    pub(super) irradiance_W_m2: BTreeMap<String, f64>,
    pub(super) time_utc: Option<TimeText>,
    pub(super) latitude_deg: Option<f64>,
    pub(super) longitude_deg: Option<f64>,
    pub(super) diffuse_fraction: Option<f64>,
    pub(super) ghi_W_m2: Option<f64>,
}

/// TOML has dates of its own; quotes around one are as good.
#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a date and time")]
pub(super) enum TimeText {
    Date(toml::value::Datetime),
    Text(String),
}
