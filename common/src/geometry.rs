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

/// Length of the longest edge, m.
pub fn longest_edge([a, b, c]: &[DVec3; 3]) -> f64 {
    a.distance(*b).max(b.distance(*c)).max(c.distance(*a))
}

/// Axis-aligned bounds of a set of points; `None` when there are none.
pub fn bounds<'a>(points: impl IntoIterator<Item = &'a DVec3>) -> Option<(DVec3, DVec3)> {
    points.into_iter().fold(None, |acc, &p| match acc {
        None => Some((p, p)),
        Some((lo, hi)) => Some((lo.min(p), hi.max(p))),
    })
}

/// The same of the corners of triangles.
pub fn bounds_of(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Option<(DVec3, DVec3)> {
    let of_one = |t: [DVec3; 3]| (t[0].min(t[1]).min(t[2]), t[0].max(t[1]).max(t[2]));
    let join = |(a, b): (DVec3, DVec3), (c, d): (DVec3, DVec3)| (a.min(c), b.max(d));
    triangles.into_iter().map(of_one).reduce(join)
}

/// The point of the part of a triangle with these corners (barycentric coordinates of its second and
/// third vertex) that two numbers in [0, 1) stand for; uniform numbers give uniform points.
pub fn point_within(
    [a, b, c]: &[DVec3; 3],
    corners: &[(f64, f64); 3],
    [r1, r2]: [f64; 2],
) -> DVec3 {
    // square-root map of the unit square to a triangle (Turk 1990)
    let (w1, w2) = (r1.sqrt() * (1.0 - r2), r1.sqrt() * r2);
    let w0 = 1.0 - w1 - w2;
    let b1 = w0 * corners[0].0 + w1 * corners[1].0 + w2 * corners[2].0;
    let b2 = w0 * corners[0].1 + w1 * corners[1].1 + w2 * corners[2].1;
    *a + b1 * (*b - *a) + b2 * (*c - *a)
}
