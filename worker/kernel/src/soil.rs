//! The soil plane, mapped in cells: where a point lies on it.

use glam::DVec2;

use crate::lattice::Extent;

/// Cells of the soil plane; cell (ix, iy) is number `iy * cells_x + ix`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoilGrid {
    /// Height of the plane, metres.
    pub z_m: f64,
    /// Lower corner of cell (0, 0), metres.
    pub min_m: DVec2,
    /// Extent of a cell, metres.
    pub cell_m: DVec2,
    /// Cells along x and y.
    pub cells: [u32; 2],
}

/// Most soil cells along a side.
const MOST_CELLS: u32 = 1 << 11;

impl SoilGrid {
    /// Cells of about `cell_m` under all of an extent.
    pub fn over(extent: &Extent, z_m: f64, cell_m: f64) -> Self {
        let min_m = extent.min_m.truncate();
        let size = extent.max_m.truncate() - min_m;
        let n = (size / cell_m)
            .round()
            .clamp(DVec2::ONE, DVec2::splat(f64::from(MOST_CELLS)));
        Self {
            z_m,
            min_m,
            cell_m: (size / n).max(DVec2::splat(f64::MIN_POSITIVE)),
            cells: [n.x as u32, n.y as u32],
        }
    }

    /// Area of a cell, m².
    pub fn cell_area_m2(&self) -> f64 {
        self.cell_m.x * self.cell_m.y
    }

    /// Number of cells.
    pub fn len(&self) -> u32 {
        self.cells[0] * self.cells[1]
    }

    /// There is always a cell.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Lower corner of a cell, metres.
    pub fn corner_m(&self, cell: u32) -> DVec2 {
        let at = DVec2::new(
            f64::from(cell % self.cells[0]),
            f64::from(cell / self.cells[0]),
        );
        self.min_m + at * self.cell_m
    }

    /// Column (axis 0) or row (axis 1) of the cells at a coordinate; `None` beyond the map of an open scene.
    pub fn along(&self, axis: usize, x_m: f64, periodic: bool) -> Option<u32> {
        let k = ((x_m - self.min_m[axis]) / self.cell_m[axis]).floor();
        let n = self.cells[axis];
        if periodic {
            Some((k as i64).rem_euclid(i64::from(n)) as u32)
        } else {
            (k >= 0.0 && k < f64::from(n)).then_some(k as u32)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_found_within_and_beyond_the_map() {
        let soil = SoilGrid {
            z_m: 0.0,
            min_m: DVec2::new(-1.0, 0.0),
            cell_m: DVec2::new(0.5, 0.25),
            cells: [4, 2],
        };
        let cell_at = |at_m: DVec2, periodic| {
            let [column, row] = [0, 1].map(|axis| soil.along(axis, at_m[axis], periodic));
            Some(row? * soil.cells[0] + column?)
        };
        for cell in 0..soil.len() {
            let within = soil.corner_m(cell) + 0.4 * soil.cell_m;
            for periodic in [false, true] {
                assert_eq!(cell_at(within, periodic), Some(cell));
            }
            let away = within + DVec2::new(-2.0 * 7.0, 0.5 * 3.0);
            assert_eq!(cell_at(away, false), None);
            assert_eq!(cell_at(away, true), Some(cell));
        }
        // a hair below the pattern's edge is in its last cell
        assert_eq!(soil.along(0, -1.0 - 1e-17, true), Some(0));
        assert_eq!(soil.along(0, -1.0 - 1e-12, true), Some(3));
    }
}
