//! Which lines of a lattice meet a triangle: scan conversion with a fill rule.
//!
//! A lattice point belongs to a triangle when it lies to the right of (or on) its left edge, to the
//! left of its right edge, at or above its lower and below its upper end. An edge is always
//! evaluated from its lower to its upper vertex, so the two triangles that share it compute the
//! very same crossing: together they cover each point once.

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
        let v = triangle.map(|p| lattice.v(p));
        let (first_row, end_row) = (
            above(v[0].min(v[1]).min(v[2])),
            above(v[0].max(v[1]).max(v[2])),
        );
        if first_row >= end_row {
            return None;
        }
        let u = triangle.map(|p| lattice.u(p));
        if above(u[0].min(u[1]).min(u[2])) >= above(u[0].max(u[1]).max(u[2])) {
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
            vertex,
            upper_along: turn > 0.0,
            first_row,
            end_row,
        })
    }

    /// Unwrapped lattice rows that the triangle reaches.
    pub fn rows(&self) -> std::ops::Range<i64> {
        self.first_row..self.end_row
    }

    /// Calls `hit` for every line that meets the triangle and whose lattice row is in `rows`
    /// (wrapped rows, `0..ny`). `with_place` fills in where on the triangle.
    #[inline]
    pub fn scan(
        &self,
        lattice: &Lattice,
        rows: std::ops::Range<u32>,
        with_place: bool,
        mut hit: impl FnMut(Fragment),
    ) {
        let [a, b, c] = self.corner;
        // plane of depth, and of the barycentric coordinates, over the lattice
        let (abu, abv, acu, acv) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
        let inverse = 1.0 / (abu * acv - acu * abv);
        if !inverse.is_finite() {
            return;
        }
        let (abs, acs) = (b[2] - a[2], c[2] - a[2]);
        let slope_u = (abs * acv - acs * abv) * inverse;
        let slope_v = (acs * abu - abs * acu) * inverse;
        let (s_lo, s_hi) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
        // crossing of an edge with a row, always from its lower end
        let rise = |p: [f64; 3], q: [f64; 3]| {
            if q[1] > p[1] {
                (q[0] - p[0]) / (q[1] - p[1])
            } else {
                0.0
            }
        };
        let (rise_ab, rise_bc, rise_ac) = (rise(a, b), rise(b, c), rise(a, c));
        let bend = above(b[1]);
        let ny = i64::from(lattice.ny);
        let mut row = self.first_row.rem_euclid(ny);
        let wrap_row = lattice.periodic;
        for j in self.first_row..self.end_row {
            let wrapped = if wrap_row {
                if row == ny {
                    row = 0;
                }
                row += 1;
                row - 1
            } else if (0..ny).contains(&j) {
                j
            } else {
                continue;
            } as u32;
            if !rows.contains(&wrapped) {
                continue;
            }
            let v = j as f64;
            let long = a[0] + (v - a[1]) * rise_ac;
            let short = if j < bend {
                a[0] + (v - a[1]) * rise_ab
            } else {
                b[0] + (v - b[1]) * rise_bc
            };
            let (left, right) = if long <= short {
                (long, short)
            } else {
                (short, long)
            };
            let (i_first, i_end) = (above(left), above(right));
            if i_first >= i_end {
                continue;
            }
            let nx = i64::from(lattice.nx);
            let row_start = wrapped as usize * lattice.nx as usize;
            let mut i_wrapped = i_first.rem_euclid(nx);
            for i in i_first..i_end {
                let column = if lattice.periodic {
                    if i_wrapped == nx {
                        i_wrapped = 0;
                    }
                    i_wrapped += 1;
                    i_wrapped - 1
                } else if (0..nx).contains(&i) {
                    i
                } else {
                    continue;
                };
                let (du, dv) = (i as f64 - a[0], v - a[1]);
                let s = (a[2] + du * slope_u + dv * slope_v).clamp(s_lo, s_hi);
                let place = if with_place {
                    let mut at = [0.0; 3];
                    at[self.vertex[1]] = (du * acv - acu * dv) * inverse;
                    at[self.vertex[2]] = (abu * dv - du * abv) * inverse;
                    at[self.vertex[0]] = 1.0 - at[self.vertex[1]] - at[self.vertex[2]];
                    [at[1], at[2]]
                } else {
                    [0.0; 2]
                };
                hit(Fragment {
                    line: row_start + column as usize,
                    depth: lattice.depth(s),
                    place,
                });
            }
        }
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
