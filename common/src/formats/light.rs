//! `.light`: parallel sources, one a line: irradiance on the horizontal, direction of travel x y z.

use glam::DVec3;

use super::error::FormatError;
use super::lines::{Fields, Lines};

/// Sources closer to the horizon than this (the sine of 0.006 degrees) are refused as horizontal:
/// at a given irradiance of the horizontal their beams would be without bounds.
pub const MIN_DESCENT: f64 = 1e-4;

/// A parallel source in one band, or in all bands alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSource {
    /// Irradiance of a horizontal plane, W m⁻², finite and `>= 0`.
    pub irradiance_W_m2: f64,
    /// Direction of travel, a unit vector with `z <= -MIN_DESCENT`.
    pub direction: DVec3,
}

/// Parses a `.light` file of at least one source; `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Vec<LightSource>, FormatError> {
    let mut sources = Vec::new();
    let mut lines = Lines::new(file, bytes);
    while let Some(mut fields) = lines.next()? {
        sources.push(source(&mut fields)?);
        fields.end()?;
    }
    if sources.is_empty() {
        return Err(lines.missing("at least one source"));
    }
    Ok(sources)
}

fn source(fields: &mut Fields<'_>) -> Result<LightSource, FormatError> {
    let fault = |fields: &Fields<'_>, expected: &str, found: String| FormatError::Content {
        place: fields.place(),
        expected: expected.to_owned(),
        found,
    };
    let irradiance_W_m2 = fields.number("an irradiance")?;
    if irradiance_W_m2 < 0.0 {
        let found = irradiance_W_m2.to_string();
        return Err(fault(fields, "an irradiance of at least 0", found));
    }
    let given = DVec3::new(
        fields.number("x of the direction of travel")?,
        fields.number("y of the direction of travel")?,
        fields.number("z of the direction of travel")?,
    );
    // scaled first, so that lengths neither overflow nor vanish
    let direction = (given / given.abs().max_element()).normalize_or_zero();
    if !direction.is_finite() || direction.z > -MIN_DESCENT {
        return Err(fault(
            fields,
            "a direction of travel that points down (z below 0)",
            format!("{} {} {}", given.x, given.y, given.z),
        ));
    }
    Ok(LightSource {
        irradiance_W_m2,
        direction,
    })
}
