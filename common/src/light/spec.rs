//! What a user says of a sky, before it is known where its sun stands.

use super::model::SkyModel;
use super::radiance::CieType;

/// The distribution of radiance over the sky.
#[derive(Clone, Debug, PartialEq)]
pub enum Sky {
    /// The same radiance from everywhere.
    UniformOvercast,
    /// Moon and Spencer: the zenith three times as bright as the horizon.
    StandardOvercast,
    /// A sky that the place of the sun shapes, and the sun.
    Sunny {
        /// How its diffuse light is distributed.
        model: SunnySky,
        /// Date and time in UTC, as RFC 3339 writes them: `2024-06-21T12:00:00Z`.
        time_utc: String,
        /// Degrees, north positive, -90 to 90.
        latitude_deg: f64,
        /// Degrees, east positive, -180 to 180.
        longitude_deg: f64,
        /// Part of the irradiance that comes from the sky and not straight from the sun, 0 to 1.
        diffuse_fraction: f64,
    },
}

/// How the diffuse light of a sky is distributed that the place of the sun shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SunnySky {
    /// A type of the CIE standard general sky.
    Cie(CieType),
    /// The all-weather sky of Perez, Seals & Michalsky 1993.
    Perez {
        /// Global irradiance of the horizontal (GHI), all wavelengths together, W m⁻², 1 to [`MOST_GLOBAL_W_M2`].
        global_W_m2: f64,
    },
}

/// More than this does not come from the sun and a bright sky, W m⁻².
pub const MOST_GLOBAL_W_M2: f64 = 2000.0;

impl SunnySky {
    /// Its model.
    pub fn model(self) -> SkyModel {
        match self {
            Self::Cie(kind) => SkyModel::Cie(kind),
            Self::Perez { .. } => SkyModel::Perez,
        }
    }
}
