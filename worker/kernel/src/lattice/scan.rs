//! Which lines of a lattice meet a triangle: scan conversion with a fill rule.
//!
//! A lattice point belongs to a triangle when it lies to the right of (or on) its left edge, to the
//! left of its right edge, at or above its lower and below its upper end. An edge is always
//! evaluated from its lower to its upper vertex, so the two triangles that share it compute the
//! very same crossing: together they cover each point once.

use std::ops::Range;

use glam::DVec3;

use super::Lattice;

/// Where a line meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fragment {
    /// Number of the line, `j * nx + i`.
    pub line: usize,
    /// Distance along the line, in steps of the lattice's depth; grows along its direction.
    pub depth: u32,
    /// Barycentric coordinates of the second and third vertex, for triangles cut into pieces.
    pub place: [f64; 2],
}

/// A triangle in lattice coordinates, ready to be scanned.
#[derive(Clone, Copy, Debug)]
pub struct Projected {
    /// By rising v, then u.
    corner: [[f64; 3]; 3],
    /// The same before rounding.
    exact: [[f64; 2]; 3],
    /// Which vertex each corner was.
    vertex: [usize; 3],
    /// The upper face looks along the direction of the lines.
    pub upper_along: bool,
    first_row: i64,
    end_row: i64,
}

impl Projected {
    /// Projects a triangle; `None` when no line can meet it.
    ///
    /// Most triangles of a canopy slip between the lines, so that is found out first.
    #[inline]
    pub fn new(lattice: &Lattice, triangle: &[DVec3; 3]) -> Option<Self> {
        let v = triangle.map(|p| lattice.v(p.y, p.z));
        let Range {
            start: first_row,
            end: end_row,
        } = whole_numbers(v);
        if first_row >= end_row {
            return None;
        }
        let u = triangle.map(|p| lattice.u(p.x, p.z));
        if whole_numbers(u).is_empty() {
            return None;
        }
        let mut vertex = [0usize, 1, 2];
        let below = |a: usize, b: usize| (v[a], u[a]) <= (v[b], u[b]);
        if !below(vertex[0], vertex[1]) {
            vertex.swap(0, 1);
        }
        if !below(vertex[1], vertex[2]) {
            vertex.swap(1, 2);
            if !below(vertex[0], vertex[1]) {
                vertex.swap(0, 1);
            }
        }
        let turn = (u[1] - u[0]) * (v[2] - v[0]) - (u[2] - u[0]) * (v[1] - v[0]);
        Some(Self {
            corner: vertex.map(|k| [u[k], v[k], lattice.s_m(triangle[k])]),
            exact: vertex.map(|k| lattice.place(triangle[k]).to_array()),
            vertex,
            upper_along: turn > 0.0,
            first_row,
            end_row,
        })
    }

    /// Calls `hit` for every line that meets the triangle and whose lattice row is in `rows`
    /// (wrapped rows, `0..ny`). `with_place` fills in where on the triangle.
    #[inline]
    pub fn scan(
        &self,
        lattice: &Lattice,
        rows: Range<u32>,
        with_place: bool,
        mut hit: impl FnMut(Fragment),
    ) {
        let [a, b, c] = self.corner;
        let bend = above(b[1]);
        // most triangles are met by no line or by one: nothing is computed before it is needed
        let long = Edge::new(a, c);
        let mut plane: Option<Plane> = None;
        for (part, edge) in [(self.first_row..bend, (a, b)), (bend..self.end_row, (b, c))] {
            if part.is_empty() {
                continue;
            }
            let short = Edge::new(edge.0, edge.1);
            for j in part {
                let Some(row) = wrap(j, lattice.ny, lattice.periodic).filter(|r| rows.contains(r))
                else {
                    continue;
                };
                let (p, q) = (long.crossing(j as f64), short.crossing(j as f64));
                let (first, end) = if p <= q {
                    (above(p), above(q))
                } else {
                    (above(q), above(p))
                };
                if first >= end {
                    continue;
                }
                let Some(plane) = plane.get_or_insert_with(|| Plane::new(self)).valid() else {
                    return;
                };
                let row_start = row as usize * lattice.nx as usize;
                for i in first..end {
                    let Some(column) = wrap(i, lattice.nx, lattice.periodic) else {
                        continue;
                    };
                    let (du, dv) = (i as f64 - a[0], j as f64 - a[1]);
                    hit(Fragment {
                        line: row_start + column as usize,
                        depth: lattice.depth(plane.s_m([i as f64, j as f64])),
                        place: if with_place {
                            plane.place(du, dv, self.vertex)
                        } else {
                            [0.0; 2]
                        },
                    });
                }
            }
        }
    }
}

/// Unwrapped lattice rows that a triangle reaches.
pub(super) fn rows(lattice: &Lattice, triangle: &[DVec3; 3]) -> Range<i64> {
    whole_numbers(triangle.map(|p| lattice.v(p.y, p.z)))
}

#[inline]
fn whole_numbers([a, b, c]: [f64; 3]) -> Range<i64> {
    above(a.min(b).min(c))..above(a.max(b).max(c))
}

/// The row or column of the lattice that an unwrapped one is; `None` past the rim of an open lattice.
#[inline]
fn wrap(k: i64, n: u32, periodic: bool) -> Option<u32> {
    if (0..i64::from(n)).contains(&k) {
        Some(k as u32)
    } else if periodic {
        Some(k.rem_euclid(i64::from(n)) as u32)
    } else {
        None
    }
}

/// An edge from its lower to its upper end: where it crosses the rows of the lattice.
struct Edge {
    start: [f64; 3],
    rise: f64,
}

impl Edge {
    #[inline]
    fn new(start: [f64; 3], end: [f64; 3]) -> Self {
        Self {
            start,
            rise: (end[0] - start[0]) / (end[1] - start[1]),
        }
    }

    #[inline]
    fn crossing(&self, v: f64) -> f64 {
        self.start[0] + (v - self.start[1]) * self.rise
    }
}

/// Depth and barycentric coordinates over the lattice, from the first corner on.
struct Plane {
    ab: [f64; 2],
    ac: [f64; 2],
    inverse: f64,
    /// Of the first corner, before rounding.
    start: [f64; 2],
    s_m: f64,
    slope: [f64; 2],
    s_range_m: [f64; 2],
}

impl Plane {
    fn new(projected: &Projected) -> Self {
        let [a, b, c] = projected.corner;
        let from = |p: [f64; 2], q: [f64; 2]| [q[0] - p[0], q[1] - p[1]];
        let (ab, ac) = (
            from([a[0], a[1]], [b[0], b[1]]),
            from([a[0], a[1]], [c[0], c[1]]),
        );
        let area = ab[0] * ac[1] - ac[0] * ab[1];
        // rounded corners say which lines meet the triangle; where they meet it, the corners as they are: rounding
        // would carry a steep face through one behind it
        let [start, p, q] = projected.exact;
        let (p, q) = (from(start, p), from(start, q));
        let rise = [b[2] - a[2], c[2] - a[2]];
        let inverse = 1.0 / (p[0] * q[1] - q[0] * p[1]);
        Self {
            ab,
            ac,
            inverse: 1.0 / area,
            start,
            s_m: a[2],
            slope: [
                (rise[0] * q[1] - rise[1] * p[1]) * inverse,
                (rise[1] * p[0] - rise[0] * q[0]) * inverse,
            ],
            s_range_m: [a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2])],
        }
    }

    /// `None` for a triangle that is seen exactly edge-on.
    fn valid(&self) -> Option<&Self> {
        self.inverse.is_finite().then_some(self)
    }

    #[inline]
    fn s_m(&self, [u, v]: [f64; 2]) -> f64 {
        let (du, dv) = (u - self.start[0], v - self.start[1]);
        let s_m = self.s_m + du * self.slope[0] + dv * self.slope[1];
        // a triangle that is nearly edge-on is steep: rounding must not carry a hit past its vertices
        let [least, greatest] = self.s_range_m;
        if s_m > least {
            s_m.min(greatest)
        } else {
            least
        }
    }

    /// Barycentric coordinates of the second and third vertex, in the user's order.
    fn place(&self, du: f64, dv: f64, vertex: [usize; 3]) -> [f64; 2] {
        let mut at = [0.0; 3];
        at[vertex[1]] = (du * self.ac[1] - self.ac[0] * dv) * self.inverse;
        at[vertex[2]] = (self.ab[0] * dv - du * self.ab[1]) * self.inverse;
        at[vertex[0]] = 1.0 - at[vertex[1]] - at[vertex[2]];
        [at[1], at[2]]
    }
}

/// The least whole number that is not below `x`; `f64::ceil` is a call where the processor's rounding
/// instruction cannot be assumed.
#[inline]
fn above(x: f64) -> i64 {
    let truncated = x as i64;
    truncated + i64::from(x > truncated as f64)
}

#[cfg(test)]
mod tests {
    use super::super::{Extent, Lattice};
    use super::*;
    use proptest::prelude::*;

    fn direction(z: f64, phi: f64) -> DVec3 {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), z)
    }

    fn count(lattice: &Lattice, triangles: &[[DVec3; 3]]) -> Vec<u32> {
        let mut hits = vec![0; lattice.lines()];
        for t in triangles {
            if let Some(p) = Projected::new(lattice, t) {
                p.scan(lattice, 0..lattice.ny, false, |f| hits[f.line] += 1);
            }
        }
        hits
    }

    proptest! {
        /// A plate that fills the pattern, cut anyhow into triangles, is met once by every line.
        #[test]
        fn a_full_periodic_plate_is_watertight(
            z in 0.02f64..1.0, phi in 0.0f64..6.3, ox in 0.0f64..1.0, oy in 0.0f64..1.0,
            mx in 0.05f64..0.95, my in 0.05f64..0.95, far in -1e3f64..1e3,
        ) {
            let extent = Extent { min_m: DVec3::ZERO, max_m: DVec3::new(0.7, 0.9, 1.0), periodic: true };
            let lattice = Lattice::new(direction(z, phi), &extent, 3e-4, [ox, oy, 0.5]);
            let at = |x: f64, y: f64| DVec3::new(0.7 * x + far, 0.9 * y - far, 0.4);
            let m = at(mx, my);
            let rim = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
            let fan: Vec<_> = (0..4).map(|k| [rim[k], rim[(k + 1) % 4], m]).collect();
            let hits = count(&lattice, &fan);
            prop_assert!(hits.iter().all(|&h| h == 1), "{:?}", hits.iter().filter(|&&h| h != 1).count());
        }

        /// Hits times cross-section is the projected area, on average over the offset.
        #[test]
        fn hits_measure_projected_area(z in 0.1f64..1.0, phi in 0.0f64..6.3, periodic: bool) {
            let extent = Extent { min_m: DVec3::ZERO, max_m: DVec3::new(1.0, 1.0, 1.0), periodic };
            let t = [DVec3::new(0.2, 0.3, 0.1), DVec3::new(0.8, 0.4, 0.9), DVec3::new(0.5, 0.9, 0.3)];
            let d = direction(z, phi);
            let lattice = Lattice::new(d, &extent, 1e-5, [0.4, 0.7, 0.5]);
            let hits: u32 = count(&lattice, &[t]).iter().sum();
            let area = 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).dot(d).abs();
            let measured = f64::from(hits) * lattice.line_area_m2;
            prop_assert!((measured - area).abs() < 0.02 * area + 2e-3, "{measured} {area}");
            let up = (t[1] - t[0]).cross(t[2] - t[0]).dot(d) > 0.0;
            prop_assert_eq!(Projected::new(&lattice, &t).map(|p| p.upper_along), Some(up));
        }
    }

    #[test]
    fn depth_and_place_follow_the_triangle() {
        let extent = Extent {
            min_m: DVec3::ZERO,
            max_m: DVec3::ONE,
            periodic: false,
        };
        let t = [
            DVec3::new(0.1, 0.1, 0.2),
            DVec3::new(0.9, 0.2, 0.8),
            DVec3::new(0.3, 0.8, 0.5),
        ];
        let lattice = Lattice::new(direction(0.7, 1.0), &extent, 1e-4, [0.1, 0.2, 0.5]);
        let mut seen = 0;
        Projected::new(&lattice, &t)
            .unwrap()
            .scan(&lattice, 0..lattice.ny, true, |f| {
                let [b1, b2] = f.place;
                let p = t[0] + b1 * (t[1] - t[0]) + b2 * (t[2] - t[0]);
                let (i, j) = (f.line % lattice.nx as usize, f.line / lattice.nx as usize);
                assert!((lattice.point_at(i as f64, j as f64, p.z) - p).length() < 1e-5);
                assert!((lattice.height_m(f.depth) - p.z).abs() < 1e-5);
                seen += 1;
            });
        assert!(seen > 500);
    }
}
