//! The projection lattice: parallel lines through the scene, and which triangles each one meets.
//!
//! A canopy is sheared along a direction onto the horizontal plane and scanned on a rectangular
//! lattice of points; each lattice point is a line. With a pattern the lattice is a torus, so a
//! periodic canopy costs nothing extra and is exact at any inclination. The lattice is fixed to the
//! world: whichever part of a scene is drawn, the same line meets the same triangles.

mod reach;
mod scan;
mod sides;
mod soup;
mod strips;

use std::ops::Range;

use glam::{DVec2, DVec3};

use crate::touch::touch_m;

pub use scan::{Fragment, Projected};
use sides::{MAX_SIDE, sides, wanted};
pub use soup::Soup;
pub use strips::Strips;
pub(crate) use strips::rows_of_part;

/// Where lines may run: what fixes a lattice to the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    /// Lower corner of everything that lines are to meet, metres. With a pattern, x and y are the
    /// pattern's lower corner.
    pub min_m: DVec3,
    /// Upper corner, metres. With a pattern, x and y are the pattern's upper corner.
    pub max_m: DVec3,
    /// The x, y rectangle repeats for ever.
    pub periodic: bool,
}

impl Extent {
    /// Lower corner and size of its shadow on the level of its lowest point.
    fn sheared(&self, shear: DVec2) -> (DVec2, DVec2) {
        let (mut lo, mut hi) = (self.min_m.truncate(), self.max_m.truncate());
        if !self.periodic {
            let slide = -shear * (self.max_m.z - self.min_m.z);
            lo += slide.min(DVec2::ZERO);
            hi += slide.max(DVec2::ZERO);
        }
        (lo, (hi - lo).max(DVec2::splat(f64::MIN_POSITIVE)))
    }

    /// Lines of that cross-section (m²) along a direction (a unit vector, z > 0) that it takes to fill it, however
    /// many: a lattice has no more than it can number.
    pub fn lines_through(&self, direction: DVec3, line_area_m2: f64) -> f64 {
        let (_, size) = self.sheared(direction.truncate() / direction.z);
        size.x * size.y * direction.z / line_area_m2
    }
}

/// Parallel lines along one direction, on a lattice of `nx * ny` points.
///
/// Coordinates `(u, v)` are in lattice steps, so that lines pass through whole numbers; `s` is the
/// distance along the direction in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Unit vector along the lines, `z > 0`.
    pub direction: DVec3,
    /// Lattice points along x and y.
    pub nx: u32,
    /// See `nx`.
    pub ny: u32,
    /// The lattice closes on itself.
    pub periodic: bool,
    /// Area of the cross-section of a line, perpendicular to it, m².
    pub line_area_m2: f64,
    steps_per_m: DVec2,
    shear: DVec2,
    offset: DVec2,
    s_min_m: f64,
    s_steps_per_m: f64,
    /// What lies closer together touches, metres.
    pub(crate) touch_m: f64,
}

/// Natural logarithm of how much longer or shorter the steps of a stretched lattice are, at most: enough that an edge of
/// ten steps ends anywhere between two rows.
const STRETCH: f64 = 0.1;

/// Rounds a lattice coordinate to 2^-20 of a step, so that copies of a vertex one pattern apart stay
/// exactly one pattern apart.
///
/// Adding and taking away 1.5 * 2^(52 - 20) leaves no bits below 2^-20, for coordinates up to 2^31.
#[inline]
fn snap(x: f64) -> f64 {
    const ROUNDER: f64 = 1.5 * (1u64 << 32) as f64;
    (x + ROUNDER) - ROUNDER
}

impl Lattice {
    /// A lattice of lines whose cross-section is close to `line_area_m2` (m², > 0).
    ///
    /// `random` are three numbers in [0, 1): the offset of the lattice in x and y (in steps), and
    /// the rounding of the number of lines, where no lattice comes within a thousandth of it: up or
    /// down at random, so that the expected number is exact. A lattice may be empty.
    pub fn new(direction: DVec3, extent: &Extent, line_area_m2: f64, random: [f64; 3]) -> Self {
        let (lines, wanted_y) = wanted(direction, extent, line_area_m2);
        let [nx, ny] = sides(lines, wanted_y, random[2]);
        // an open lattice that is not aligned with its box has one more point along a side
        let points = [nx, ny].map(|n| n as u32 + u32::from(!extent.periodic && n > 0.0));
        let steps = DVec2::new(nx.max(1.0), ny);
        Self::with((direction, extent), steps, points, [random[0], random[1]])
    }

    /// A lattice whose steps are up to a tenth longer or shorter than those of [`Self::new`], at random, and which
    /// does not fit the box of an open scene: so the edges of panels stand anywhere between its rows, even where they
    /// are as large as the scene. `random` are four numbers in [0, 1): the offset in x and y, and how much it is
    /// stretched along each.
    pub fn stretched(
        direction: DVec3,
        extent: &Extent,
        line_area_m2: f64,
        random: [f64; 4],
    ) -> Self {
        let (lines, wanted_y) = wanted(direction, extent, line_area_m2);
        let stretch = |random: f64| (STRETCH * (2.0 * random - 1.0)).exp();
        let wanted_y = wanted_y.min(lines.max(1.0));
        let (nx, ny) = (
            lines / wanted_y * stretch(random[2]),
            wanted_y * stretch(random[3]),
        );
        let steps = DVec2::new(nx, ny).clamp(DVec2::ONE, DVec2::splat(MAX_SIDE));
        let steps = if extent.periodic {
            steps.round()
        } else {
            steps
        };
        // one point for each step that begins in the box, and one at either end
        let points = [steps.x, steps.y].map(|n| n as u32 + 2 * u32::from(!extent.periodic));
        Self::with((direction, extent), steps, points, [random[0], random[1]])
    }

    /// A lattice of so many steps and points along x and y.
    fn with(
        (direction, extent): (DVec3, &Extent),
        steps: DVec2,
        points: [u32; 2],
        offset: [f64; 2],
    ) -> Self {
        let d = direction;
        let shear = DVec2::new(d.x / d.z, d.y / d.z);
        let height = extent.max_m.z - extent.min_m.z;
        let (lo, size) = extent.sheared(shear);
        let steps_per_m = steps / size;
        // s = (z - z_min) / d.z runs over at most this range
        let s_range = (height / d.z).max(f64::MIN_POSITIVE);
        Self {
            direction: d,
            nx: points[0],
            ny: points[1],
            periodic: extent.periodic,
            line_area_m2: size.x * size.y * d.z / (steps.x * steps.y),
            steps_per_m,
            shear,
            offset: DVec2::from(offset) - (lo - shear * extent.min_m.z) * steps_per_m,
            s_min_m: extent.min_m.z / d.z,
            s_steps_per_m: S_STEPS / s_range,
            touch_m: touch_m(extent.min_m, extent.max_m),
        }
    }

    /// Lattice coordinates of the lower and upper corners of what holds a box.
    pub fn places_of_box(&self, lo: DVec3, hi: DVec3) -> [DVec2; 2] {
        let corners = [lo.z, hi.z].map(|z| [lo.with_z(z), hi.with_z(z)].map(|p| self.place(p)));
        let [[a, b], [c, d]] = corners;
        [a.min(c), b.max(d)]
    }

    /// Steps of the lattice that a metre takes at most, whichever way it points.
    pub(crate) fn most_steps_per_m(&self) -> f64 {
        let along = |axis: usize| self.steps_per_m[axis] * self.shear[axis].hypot(1.0);
        along(0).hypot(along(1))
    }

    /// Whether lines of some rows may meet a triangle; lattice coordinates are rounded to a millionth.
    pub(crate) fn may_meet(&self, rows: &Range<u32>, triangle: &[DVec3; 3]) -> bool {
        const ROUNDED: f64 = 1e-3;
        let [a, b, c] = triangle.map(|p| self.place(p).y);
        let (lo, hi) = (a.min(b).min(c) - ROUNDED, a.max(b).max(c) + ROUNDED);
        let (first, last) = (f64::from(rows.start), f64::from(rows.end) - 1.0);
        if !self.periodic {
            return lo <= last && hi >= first;
        }
        // some copy of it does
        let ny = f64::from(self.ny);
        ((lo - last) / ny).ceil() <= ((hi - first) / ny).floor()
    }

    /// Number of lines.
    pub fn lines(&self) -> usize {
        self.nx as usize * self.ny as usize
    }

    /// Lattice coordinates of a point, before rounding.
    pub fn place(&self, p: DVec3) -> DVec2 {
        (p.truncate() - p.z * self.shear) * self.steps_per_m + self.offset
    }

    /// The point at height `z_m` on the line through lattice point `(i, j)`.
    pub fn point_at(&self, i: f64, j: f64, z_m: f64) -> DVec3 {
        DVec3::new(
            (i - self.offset.x) / self.steps_per_m.x + z_m * self.shear.x,
            (j - self.offset.y) / self.steps_per_m.y + z_m * self.shear.y,
            z_m,
        )
    }

    /// The places, in lattice coordinates, where a line may meet a triangle at a depth: one for each copy of the triangle
    /// that is there.
    pub(crate) fn places_of(
        &self,
        (line, depth): (usize, u32),
        triangle: &[DVec3; 3],
    ) -> impl Iterator<Item = DVec2> + use<> {
        // a low sun draws triangles out over many patterns, but at one height a triangle is no larger than it is
        let z_m = self.height_m(depth);
        let corners = triangle.map(|p| self.place(p.with_z(z_m)));
        let lo = corners[0].min(corners[1]).min(corners[2]);
        let hi = corners[0].max(corners[1]).max(corners[2]);
        let nx = self.nx as usize;
        let at = DVec2::new((line % nx) as f64, (line / nx) as f64);
        let copies = |at: f64, n: u32, lo: f64, hi: f64| {
            if !self.periodic {
                return 0..=0;
            }
            let n = f64::from(n);
            // heights are rounded to steps of the depth
            let (first, last) = (
                ((lo - at) / n - 1e-3).ceil(),
                ((hi - at) / n + 1e-3).floor(),
            );
            first as i64..=last as i64
        };
        let (across, along) = (
            copies(at.x, self.nx, lo.x, hi.x),
            copies(at.y, self.ny, lo.y, hi.y),
        );
        let size = DVec2::new(f64::from(self.nx), f64::from(self.ny));
        along.flat_map(move |l| {
            let k = across.clone();
            k.map(move |k| at + DVec2::new(k as f64, l as f64) * size)
        })
    }

    #[inline]
    fn u(&self, x: f64, z: f64) -> f64 {
        snap((x - z * self.shear.x) * self.steps_per_m.x + self.offset.x)
    }

    #[inline]
    fn v(&self, y: f64, z: f64) -> f64 {
        snap((y - z * self.shear.y) * self.steps_per_m.y + self.offset.y)
    }

    #[inline]
    fn s_m(&self, p: DVec3) -> f64 {
        p.z / self.direction.z
    }

    /// Distance along the line as a whole number that sorts like it; see [`Self::distance_m`].
    #[inline]
    pub(crate) fn depth(&self, s_m: f64) -> u32 {
        // a float-to-integer cast saturates: what lies outside the extent sorts to its ends
        ((s_m - self.s_min_m) * self.s_steps_per_m) as u32
    }

    /// Distance along the line of a depth, metres.
    pub(crate) fn s_of_depth_m(&self, depth: u32) -> f64 {
        f64::from(depth) / self.s_steps_per_m + self.s_min_m
    }

    /// Metres along the line between two depths of fragments.
    pub fn distance_m(&self, depth_difference: u32) -> f64 {
        f64::from(depth_difference) / self.s_steps_per_m
    }

    /// Height of a depth, metres.
    pub fn height_m(&self, depth: u32) -> f64 {
        self.s_of_depth_m(depth) * self.direction.z
    }

    /// Depth of a height, all along a horizontal plane.
    pub fn depth_of_height(&self, z_m: f64) -> u32 {
        self.depth(z_m / self.direction.z)
    }
}

/// Number of depth steps from the bottom to the top of the extent: the range of a line is resolved
/// to one part in four thousand million.
const S_STEPS: f64 = DEPTH_OF_TOP as f64;

/// Depth of the top of the extent; that of its bottom is 0.
pub const DEPTH_OF_TOP: u32 = u32::MAX - 1;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn extent(periodic: bool) -> Extent {
        Extent {
            min_m: DVec3::new(-0.4, -0.75, 0.0),
            max_m: DVec3::new(0.4, 0.75, 2.5),
            periodic,
        }
    }

    proptest! {
        #[test]
        fn points_go_to_the_lattice_and_back(z in 0.01f64..1.0, phi in 0.0f64..6.3, h in 0.0f64..2.5, a in 0.0f64..1.0) {
            let r = (1.0 - z * z).sqrt();
            let d = DVec3::new(r * phi.cos(), r * phi.sin(), z);
            for periodic in [true, false] {
                let l = Lattice::new(d, &extent(periodic), 1e-5, [a, 0.3, 0.5]);
                let p = DVec3::new(0.1, -0.2, h);
                let uv = l.place(p);
                let back = l.point_at(uv.x, uv.y, h);
                prop_assert!((back - p).length() < 1e-9);
                // a step along the direction stays on the line
                prop_assert!((l.place(p + 0.1 * d) - uv).length() < 1e-6 * uv.length().max(1.0));
            }
        }

        #[test]
        fn an_open_lattice_covers_its_box(z in 0.001f64..1.0, phi in 0.0f64..6.3, corner in 0usize..8) {
            let r = (1.0 - z * z).sqrt();
            let d = DVec3::new(r * phi.cos(), r * phi.sin(), z);
            let e = extent(false);
            let l = Lattice::new(d, &e, 1e-4, [0.0, 0.0, 0.5]);
            let pick = |b: usize, lo: f64, hi: f64| if corner >> b & 1 == 0 { lo } else { hi };
            let uv = l.place(DVec3::new(
                pick(0, e.min_m.x, e.max_m.x),
                pick(1, e.min_m.y, e.max_m.y),
                pick(2, e.min_m.z, e.max_m.z),
            ));
            let slack = 1e-6;
            prop_assert!(uv.x >= -slack && uv.x <= f64::from(l.nx) + slack, "{uv} of {}", l.nx);
            prop_assert!(uv.y >= -slack && uv.y <= f64::from(l.ny) + slack, "{uv} of {}", l.ny);
        }
    }

    #[test]
    fn a_narrow_pattern_has_one_column_of_lines() {
        let narrow = Extent {
            min_m: DVec3::ZERO,
            max_m: DVec3::new(1e-5, 10.0, 0.01),
            periodic: true,
        };
        let l = Lattice::new(DVec3::Z, &narrow, 1e-7, [0.3, 0.3, 0.5]);
        assert!(l.nx == 1 && (900..1100).contains(&l.ny), "{l:?}");
    }

    #[test]
    fn the_expected_number_of_lines_is_exact() {
        let n = 2000;
        for (z, area) in [(0.8, 0.013), (0.05, 0.013), (0.05, 0.0007), (1.0, 0.7)] {
            let d = DVec3::new((1.0f64 - z * z).sqrt(), 0.0, z);
            let lines = |k: u32| {
                Lattice::new(
                    d,
                    &extent(true),
                    area,
                    [0.0, 0.0, (f64::from(k) + 0.5) / f64::from(n)],
                )
                .lines()
            };
            let mean = (0..n).map(lines).sum::<usize>() as f64 / f64::from(n);
            assert!(
                (mean / (1.2 * z / area) - 1.0).abs() < 2e-3,
                "{z} {area}: {mean}"
            );
        }
    }
}
