//! Light as a user describes it, before it is turned into sources.

use serde::Deserialize;

/// A built-in sky.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Sky {
    /// The same radiance from everywhere.
    UniformOvercast,
    /// Moon–Spencer: radiance proportional to `(1 + 2 sin elevation) / 3`.
    StandardOvercast,
    /// The sun and a cloudless sky; x points east and y north.
    Clear {
        /// RFC 3339 in UTC, e.g. `2024-06-21T12:00:00Z`.
        time_utc: String,
        /// Degrees, north positive, -90 to 90.
        latitude_deg: f64,
        /// Degrees, east positive, -180 to 180.
        longitude_deg: f64,
        /// Part of the irradiance on the horizontal that does not come straight from the sun, 0 to 1.
        diffuse_fraction: f64,
    },
}

/// A built-in sky and how bright it is.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkyLight {
    /// Where the light comes from.
    pub sky: Sky,
    /// Sun and sky together on the horizontal, per band, W m⁻².
    pub irradiance_W_m2: Vec<f64>,
}
