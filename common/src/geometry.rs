//! Plain geometry of triangles, in f64.

use glam::DVec3;

/// Twice the area times the unit normal of the upper face.
pub fn doubled_area_vector([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (*b - *a).cross(*c - *a)
}

/// One-sided area, in the square of the unit of the vertices.
pub fn area(triangle: &[DVec3; 3]) -> f64 {
    0.5 * doubled_area_vector(triangle).length()
}

/// Axis-aligned bounds of a set of points; `None` when there are none.
pub fn bounds<'a>(points: impl IntoIterator<Item = &'a DVec3>) -> Option<(DVec3, DVec3)> {
    points.into_iter().fold(None, |acc, &p| match acc {
        None => Some((p, p)),
        Some((lo, hi)) => Some((lo.min(p), hi.max(p))),
    })
}
