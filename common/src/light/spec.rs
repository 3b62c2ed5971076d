//! What a user says of a sky, before it is known where its sun stands.

/// The distribution of radiance over the sky.
#[derive(Clone, Debug, PartialEq)]
pub enum Sky {
    /// The same radiance from everywhere.
    UniformOvercast,
    /// Moon and Spencer: the zenith three times as bright as the horizon.
    StandardOvercast,
    /// A clear sky and the sun.
    Clear {
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
