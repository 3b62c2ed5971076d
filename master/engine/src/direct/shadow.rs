//! The shadow that a direction throws on the soil around the map of an open scene.
//!
//! Zones near the map may be smaller than the lattice is on the ground, where a low sun draws it out. So zones are not
//! shaded by the points that fall on them, but look up at places of their own what the nearest point met.

use glam::DVec3;
use nestrad_kernel::ground::OuterSoil;
use nestrad_kernel::lattice::Lattice;

/// Which points of a lattice meet something above the soil.
pub(super) struct Shadow {
    met: Vec<u64>,
    nx: usize,
}

/// Places along each side of a zone.
const PLACES: usize = 4;

/// The light that does not get to a zone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shade {
    pub(super) zone: u32,
    /// In parts of what gets there otherwise.
    pub(super) part: f64,
}

impl Shadow {
    pub(super) fn new(lattice: &Lattice) -> Self {
        Self {
            met: vec![0; lattice.lines().div_ceil(64)],
            nx: lattice.nx as usize,
        }
    }

    /// Counts a point that meets something.
    pub(super) fn meets(&mut self, i: usize, j: usize) {
        let point = j * self.nx + i;
        self.met[point / 64] |= 1 << (point % 64);
    }

    fn is_met(&self, i: usize, j: usize) -> bool {
        let point = j * self.nx + i;
        self.met[point / 64] >> (point % 64) & 1 == 1
    }

    /// The zones that are shaded, on soil at this height.
    pub(super) fn on(&self, outer: &OuterSoil, lattice: &Lattice, z_m: f64) -> Vec<Shade> {
        let [columns, rows] = outer.sides();
        // the nearest point of the lattice to each place, along one side
        let points = |axis: usize, count: u32, most: u32| -> Vec<[Option<usize>; PLACES]> {
            let of_zone = |k: u32| {
                let [from, to] = [k, k + 1].map(|k| outer.edge_m(axis, k));
                std::array::from_fn(|p| {
                    let at = from + (to - from) * (p as f64 + 0.5) / PLACES as f64;
                    let mut place = DVec3::new(0.0, 0.0, z_m);
                    place[axis] = at;
                    let nearest = lattice.place(place)[axis].round();
                    (nearest >= 0.0 && nearest < f64::from(most)).then_some(nearest as usize)
                })
            };
            (0..count).map(of_zone).collect()
        };
        let (across, along) = (points(0, columns, lattice.nx), points(1, rows, lattice.ny));
        let mut shades = Vec::new();
        for (row, js) in (0..).zip(&along) {
            for (column, is) in (0..).zip(&across) {
                let met = js.iter().flatten().map(|&j| {
                    let met = is.iter().flatten().filter(|&&i| self.is_met(i, j));
                    met.count()
                });
                let met: usize = met.sum();
                if met > 0 {
                    shades.push(Shade {
                        zone: row * columns + column,
                        part: met as f64 / (PLACES * PLACES) as f64,
                    });
                }
            }
        }
        shades
    }
}
