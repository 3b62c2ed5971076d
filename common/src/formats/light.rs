//! `.light`: parallel sources, one a line: irradiance on the horizontal, direction of travel x y z.

use glam::DVec3;

use super::error::FormatError;
use super::lines::{Fields, Lines};
use crate::light::{AN_IRRADIANCE, MIN_DESCENT, POINTS_DOWN, is_irradiance};

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
    if !is_irradiance(irradiance_W_m2) {
        let found = format!("{irradiance_W_m2:e}");
        return Err(fault(
            fields,
            &format!("an irradiance of {AN_IRRADIANCE}"),
            found,
        ));
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
            POINTS_DOWN,
            format!("{} {} {}", given.x, given.y, given.z),
        ));
    }
    Ok(LightSource {
        irradiance_W_m2,
        direction,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(text: &str) -> String {
        parse("a.light", text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn directions_become_unit_vectors() {
        let text = "# sun\n\n400 0 0 -2\r\n0 3 0 -4 # dark\n1 1e300 0 -1e300\n1 0 1e-300 -1e-300";
        let sources = parse("a.light", text.as_bytes()).unwrap();
        assert_eq!(sources.len(), 4);
        assert_eq!(sources[0].direction, DVec3::NEG_Z);
        assert_eq!(sources[0].irradiance_W_m2, 400.0);
        let expected = DVec3::new(0.6, 0.0, -0.8);
        assert!(sources[1].direction.abs_diff_eq(expected, 1e-15));
        for source in sources {
            assert!((source.direction.length() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn sources_that_do_not_come_from_above_are_refused() {
        for direction in [
            "0 0 1",
            "1 0 0",
            "1 1 0.0001",
            "0 0 0",
            "-0 0 -0",
            "1 0 -1e-9",
        ] {
            let error = refusal(&format!("1 0 0 -1\n2 {direction}\n"));
            let expected = "a.light, line 2: expected a direction of travel that points down";
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn what_is_no_light_is_refused() {
        for (text, expected) in [
            (
                "",
                "a.light, line 1: expected at least one source, found the end of the file",
            ),
            (
                "\n#\n",
                "a.light, line 2: expected at least one source, found the end of the file",
            ),
            (
                "-1 0 0 -1",
                "a.light, line 1: expected an irradiance of 0 or 1e-100 to 1e100, found -1e0",
            ),
            (
                "nan 0 0 -1",
                "a.light, line 1: expected an irradiance, a finite number, found 'nan'",
            ),
            (
                "1 0 0",
                "a.light, line 1: expected z of the direction of travel, a finite number, found the end of the line",
            ),
            (
                "1 0 0 -1 9",
                "a.light, line 1: expected the end of the line, found '9'",
            ),
            (
                "1 0 inf -1",
                "a.light, line 1: expected y of the direction of travel, a finite number, found 'inf'",
            ),
            (
                "\u{1}\0",
                "a.light, line 1: expected an irradiance, a finite number, found '\\u{1}\\0'",
            ),
        ] {
            assert_eq!(refusal(text), expected);
        }
    }
}
