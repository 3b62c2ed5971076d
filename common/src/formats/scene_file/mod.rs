//! `scene.toml`: all that a solve needs, in one file.
//!
//! ```toml
//! scene = "maize.can.gz"              # or a list of files
//! unit = "m"                          # of geometry, pattern and soil
//! up = "z"                            # or "y": the axis of the geometry files that points up
//! pattern = "maize.8"                 # or [x0, y0, x1, y1]
//! soil = -0.002
//! light = "clear.light"
//!
//! [[bands]]
//! name = "PAR"
//! optics = "par.opt"
//! photon_umol_J = 4.57                # or wavelengths_nm = [400, 700]: tables have photons too
//!
//! [[bands]]
//! name = "NIR"
//! soil_albedo = 0.25
//! [bands.materials]
//! bark = { rho = 0.4 }
//! leaf = { upper = { rho = 0.44, tau = 0.45 }, lower = { rho = 0.46, tau = 0.44 } }
//!
//! [kinds]                             # what counts as what in balance and tables
//! materials = { bark = "stem", bench = "structure" }      # of OBJ, which else are leaves
//! species = { 3 = "structure" }                           # of CAN
//!
//! [options]
//! accuracy_percent = 0.5
//! ```
//!
//! In place of `light = "FILE"`: `[light.files]`, with one `.light` file for each band's name, or
//! `[light.sky]` with `irradiance_W_m2 = { PAR = 400.0, NIR = 380.0 }` and `kind = "uniform_overcast"` or
//! `"standard_overcast"`; or, with the keys `time_utc`, `latitude_deg`, `longitude_deg` and `diffuse_fraction`, `"clear"`,
//! `"cie_1"` to `"cie_15"` or `"perez"`, which also needs `ghi_W_m2`. For weather (`nestrad series`, `nestrad day`) `[light.band_fraction]` says which
//! part of broadband irradiance a band gets: `PAR = 0.48`. Paths are relative to the scene file.

mod checks;
mod hints;
mod tables;
#[cfg(test)]
mod tests;

use std::fmt::Display;
use std::ops::Range;
use std::path::Path;

use tables::SceneFile;

use super::error::{FormatError, Place};
use crate::bounded::with_line_feeds;
use crate::inputs::Inputs;

/// Parses a scene file; `file` is its name in messages, `folder` what its paths are relative to.
pub fn parse(file: &str, bytes: &[u8], folder: &Path) -> Result<Inputs, FormatError> {
    // TOML knows no carriage return that ends a line by itself; other files of ours do
    let bytes = with_line_feeds(bytes);
    let text = Text::new(file, &bytes)?;
    let raw: SceneFile = toml::from_str(text.text).map_err(|error| {
        let span = error.span();
        let place = span.as_ref().map(|span| text.place(span));
        FormatError::Scene {
            place: place.unwrap_or_else(|| Place::file(file)),
            message: hints::message(error.message(), text.text, span.as_ref()),
        }
    })?;
    checks::inputs(raw, &text, folder)
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

    fn message(&self, span: &Range<usize>, message: impl Display) -> FormatError {
        FormatError::Scene {
            place: self.place(span),
            message: message.to_string(),
        }
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
