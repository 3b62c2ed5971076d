//! `.8`: the rectangle on which a canopy repeats, as two opposite corners, x y and x y.

use glam::DVec2;

use super::error::{FormatError, Place};
use super::geometry_file::MAX_COORDINATE;
use super::lines::Lines;

/// On anything smaller, in the file's unit, no plant stands.
pub const MIN_SIDE: f64 = 1e-9;

/// A rectangle in the file's own unit and coordinates, with sides of [`MIN_SIDE`] or more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Lower corner.
    pub min: DVec2,
    /// Upper corner, greater in x and y.
    pub max: DVec2,
}

impl Rectangle {
    /// From two opposite corners in any order, x y and x y; `None` if they span no area, are not finite, or
    /// lie too far out.
    pub fn from_corners(corners: [f64; 4]) -> Option<Self> {
        let [x0, y0, x1, y1] = corners;
        let (a, b) = (DVec2::new(x0, y0), DVec2::new(x1, y1));
        let (min, max) = (a.min(b), a.max(b));
        let proper = corners
            .iter()
            .all(|value| value.is_finite() && value.abs() <= MAX_COORDINATE);
        let area = (max - min).min_element() >= MIN_SIDE;
        (proper && area).then_some(Self { min, max })
    }
}

/// Parses a `.8` file; `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Rectangle, FormatError> {
    let mut lines = Lines::new(file, bytes);
    let mut corners = Vec::with_capacity(4);
    let mut last = 1;
    while let Some(mut fields) = lines.next()? {
        last = fields.line();
        // corners are free to share a line, but all four numbers are needed and no more
        while fields.clone().next().is_some() && corners.len() < 4 {
            corners.push(fields.number("a coordinate of a corner")?);
        }
        fields.end()?;
    }
    let corners = <[f64; 4]>::try_from(corners)
        .map_err(|_| lines.missing("two corners of the pattern, x y and x y"))?;
    Rectangle::from_corners(corners).ok_or_else(|| refused(Place::line(file, last), corners))
}

/// The error for corners that span no area, or lie too far out.
pub(super) fn refused(place: Place, corners: [f64; 4]) -> FormatError {
    FormatError::Content {
        place,
        expected: format!(
            "corners {MIN_SIDE:e} or more apart in x and in y, finite and within {MAX_COORDINATE:e} of zero"
        ),
        found: corners.map(|value| value.to_string()).join(" "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Rectangle, String> {
        parse("a.8", text.as_bytes()).map_err(|error| error.to_string())
    }

    #[test]
    fn corners_come_in_any_order_and_layout() {
        let expected = parsed("-0.4 -0.75\n0.4 0.75\n").unwrap();
        assert_eq!(expected.min, DVec2::new(-0.4, -0.75));
        assert_eq!(expected.max, DVec2::new(0.4, 0.75));
        for text in [
            "0.4 0.75\r\n-0.4 -0.75",
            "-0.4 0.75\n0.4 -0.75",
            "# rows\n0.4 -0.75 -0.4 0.75 # m\n\n",
        ] {
            assert_eq!(parsed(text).unwrap(), expected);
        }
    }

    #[test]
    fn patterns_without_area_are_refused() {
        for text in [
            "0 0\n0 1\n",
            "0 1\n5 1\n",
            "1 1 1 1",
            "0 0\n1e-320 1",
            "0 0\n2e12 1",
        ] {
            let error = parsed(text).unwrap_err();
            assert!(
                error.contains("expected corners 1e-9 or more apart"),
                "{error}"
            );
        }
        assert_eq!(
            parsed("0 0\nNaN 1\n").unwrap_err(),
            "a.8, line 2: expected a coordinate of a corner, a finite number, found 'NaN'"
        );
    }

    #[test]
    fn too_few_or_too_many_corners_are_refused() {
        for text in ["", "0 0", "0 0\n1\n"] {
            assert!(
                parsed(text)
                    .unwrap_err()
                    .contains("expected two corners of the pattern")
            );
        }
        assert_eq!(
            parsed("0 0\n1 1\n2 2\n").unwrap_err(),
            "a.8, line 3: expected the end of the line, found '2'"
        );
    }
}
