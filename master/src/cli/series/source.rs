//! Where the weather of a series is from.

use serde::Serialize;

/// Where the weather is from.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Source {
    File(String),
    Day {
        date: String,
        every_s: f64,
        turbidity: f64,
        model: &'static str,
    },
}
