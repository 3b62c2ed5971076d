//! The ground of a scene: the map of its soil and, where it is open, the soil around it. Which end a point of the
//! plane is, is told here alone.
//!
//! The soil around the map of an open scene has no rows: what it sends out follows from the sources, and from what
//! the plants take of them there. So it is divided, whatever the light, into zones that grow with their distance
//! from the plants, up to where the lowest sun throws a shadow.

use glam::DVec2;

use crate::ends::Ends;
use crate::lattice::Extent;
use crate::soil::SoilGrid;
use crate::world::World;

/// Each ring of zones reaches this many times as far from the plants as the one within it.
const GROWTH: f64 = 1.2;

/// Rings around the map. The last one ends a thousand heights away from the plants, where the sun stands 0.06
/// degrees high at the end of their shadow, and a leaf sees less than 0.05 % of what it sees.
const RINGS: usize = 38;

/// Where each ring ends, in parts of where the first begins.
const RING_ENDS: [f64; RINGS] = {
    let mut ends = [GROWTH; RINGS];
    let mut k = 1;
    while k < RINGS {
        ends[k] = ends[k - 1] * GROWTH;
        k += 1;
    }
    ends
};

/// Zones along a side of the map, at most.
const MOST_BLOCKS: f64 = 64.0;

/// The soil around the map of an open scene, cut by lines parallel to the sides of the map. Zone (ix, iy) is number
/// `iy * columns + ix`; those in the middle stand for the map and are seen by nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OuterSoil {
    min_m: DVec2,
    max_m: DVec2,
    /// From the plants to the edge of the map, metres.
    margin_m: f64,
    /// Zones along each side of the map.
    blocks: [u32; 2],
}

impl OuterSoil {
    /// Around the map of an open scene, which reaches as far from the plants as these are high; none around
    /// plants without height, which throw no shadow.
    fn around(soil: &SoilGrid, extent: &Extent) -> Option<Self> {
        let margin_m = extent.max_m.z - extent.min_m.z;
        let of_map_m = soil.cell_m * DVec2::new(f64::from(soil.cells[0]), f64::from(soil.cells[1]));
        let blocks = (of_map_m / (margin_m * (GROWTH - 1.0))).round();
        let blocks = blocks.clamp(DVec2::ONE, DVec2::splat(MOST_BLOCKS));
        let outer = Self {
            min_m: soil.min_m,
            max_m: soil.min_m + of_map_m,
            margin_m,
            blocks: [blocks.x as u32, blocks.y as u32],
        };
        let reach_m = margin_m * RING_ENDS[RINGS - 1];
        (!extent.periodic && margin_m > 0.0 && reach_m.is_finite()).then_some(outer)
    }

    fn columns(&self, axis: usize) -> u32 {
        2 * RINGS as u32 + self.blocks[axis]
    }

    /// Number of zones.
    pub fn len(&self) -> u32 {
        self.columns(0) * self.columns(1)
    }

    /// There is always a zone.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Column (axis 0) or row (axis 1) of the zones at a coordinate; `None` beyond all rings.
    fn along(&self, axis: usize, x_m: f64) -> Option<u32> {
        let (min_m, max_m) = (self.min_m[axis], self.max_m[axis]);
        let ring = |from_map_m: f64| {
            let away = 1.0 + from_map_m / self.margin_m;
            let ring = RING_ENDS.partition_point(|&end| end <= away);
            (ring < RINGS).then_some(ring as u32)
        };
        let (rings, blocks) = (RINGS as u32, self.blocks[axis]);
        if x_m < min_m {
            ring(min_m - x_m).map(|ring| rings - 1 - ring)
        } else if x_m < max_m {
            let block = (x_m - min_m) / (max_m - min_m) * f64::from(blocks);
            Some(rings + (block as u32).min(blocks - 1))
        } else {
            ring(x_m - max_m).map(|ring| rings + blocks + ring)
        }
    }

    /// Where a column (axis 0) or row (axis 1) begins, metres; with their number, where the last one ends.
    pub fn edge_m(&self, axis: usize, column: u32) -> f64 {
        let (rings, blocks) = (RINGS as u32, self.blocks[axis]);
        let (min_m, max_m) = (self.min_m[axis], self.max_m[axis]);
        let ring_m = |rings: u32| match rings.checked_sub(1) {
            Some(ring) => self.margin_m * (RING_ENDS[ring as usize] - 1.0),
            None => 0.0,
        };
        if column < rings {
            min_m - ring_m(rings - column)
        } else if column <= rings + blocks {
            min_m + (max_m - min_m) * f64::from(column - rings) / f64::from(blocks)
        } else {
            max_m + ring_m(column - rings - blocks)
        }
    }

    /// Area of a zone, m².
    pub fn area_m2(&self, zone: u32) -> f64 {
        let columns = self.columns(0);
        let width_m = |axis, column| self.edge_m(axis, column + 1) - self.edge_m(axis, column);
        width_m(0, zone % columns) * width_m(1, zone / columns)
    }

    /// Columns and rows of zones.
    pub fn sides(&self) -> [u32; 2] {
        [0, 1].map(|axis| self.columns(axis))
    }
}

/// Column or row of a point of the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Along {
    /// Of the map's cells.
    cell: Option<u32>,
    /// Of the zones around it.
    zone: Option<u32>,
}

/// The soil plane of a scene, with the numbers of its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    soil: SoilGrid,
    outer: Option<OuterSoil>,
    ends: Ends,
    periodic: bool,
}

impl Ground {
    /// Of a scene with a soil plane.
    pub fn of(world: &World) -> Option<Self> {
        Some(Self {
            soil: world.soil?,
            outer: world.outer_soil(),
            ends: world.ends(),
            periodic: world.extent.periodic,
        })
    }

    /// Column (axis 0) or row (axis 1) of what lies at a coordinate.
    pub fn along(&self, axis: usize, x_m: f64) -> Along {
        let cell = self.soil.along(axis, x_m, self.periodic);
        Along {
            cell,
            zone: self.outer.and_then(|outer| outer.along(axis, x_m)),
        }
    }

    /// The end in that column and row.
    pub fn end(&self, column: Along, row: Along) -> u32 {
        if let Some((column, row)) = column.cell.zip(row.cell) {
            return self.ends.soil(row * self.soil.cells[0] + column);
        }
        match (self.outer, column.zone, row.zone) {
            (Some(outer), Some(column), Some(row)) => {
                self.ends.zone(row * outer.columns(0) + column)
            }
            _ => self.ends.outer_soil(),
        }
    }

    /// The end at a point.
    pub fn end_at(&self, at_m: DVec2) -> u32 {
        self.end(self.along(0, at_m.x), self.along(1, at_m.y))
    }
}

impl World {
    /// The soil around the map, where there is any that may be shaded.
    pub fn outer_soil(&self) -> Option<OuterSoil> {
        OuterSoil::around(self.soil.as_ref()?, &self.extent)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    /// A plant 1 m high, on 2 m x 3 m of ground with the soil around it.
    fn world() -> World {
        let extent = Extent {
            min_m: DVec3::new(-1.0, -1.0, 0.0),
            max_m: DVec3::new(1.0, 2.0, 1.0),
            periodic: false,
        };
        World {
            extent,
            elements: 3,
            soil: Some(SoilGrid::over(&extent, 0.0, 0.3)),
            radius_m: f64::INFINITY,
            far: None,
        }
    }

    #[test]
    fn what_is_far_away_has_an_end_of_its_own() {
        let world = world();
        let (ground, ends) = (Ground::of(&world).unwrap(), world.ends());
        let soil = world.soil.unwrap();
        for cell in 0..soil.len() {
            let middle = soil.corner_m(cell) + 0.5 * soil.cell_m;
            assert_eq!(ground.end_at(middle), ends.soil(cell));
        }
        assert_eq!(ground.end_at(DVec2::new(1e9, 0.0)), ends.outer_soil());
        let near = ground.end_at(DVec2::new(1.1, 0.0));
        assert!(ends.is_outer_soil(near) && near != ends.outer_soil());
        assert!(near < ends.len() as u32);
        // plants without height throw no shadow
        let mut flat = world;
        flat.extent.max_m.z = 0.0;
        assert_eq!(flat.outer_soil(), None);
    }

    proptest! {
        #[test]
        fn a_zone_is_as_large_as_what_lies_in_it(x in -60.0f64..60.0, y in -60.0f64..60.0) {
            let outer = world().outer_soil().unwrap();
            let zone = |at: DVec2| {
                let [column, row] = [0, 1].map(|axis| outer.along(axis, at[axis]));
                Some(row? * outer.columns(0) + column?)
            };
            let here = zone(DVec2::new(x, y)).unwrap();
            // its sides, found by walking to them
            let side = |axis: usize, sign: f64| {
                let at = |step: f64| {
                    let mut at = DVec2::new(x, y);
                    at[axis] += sign * step;
                    at
                };
                let (mut low, mut high) = (0.0, 100.0);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if zone(at(middle)) == Some(here) { low = middle } else { high = middle }
                }
                low
            };
            let area = (side(0, -1.0) + side(0, 1.0)) * (side(1, -1.0) + side(1, 1.0));
            prop_assert!((area / outer.area_m2(here) - 1.0).abs() < 1e-6, "{area}");
        }
    }
}
