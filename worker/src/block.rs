//! A block, checked and made ready for the kernel.

use glam::{DVec2, DVec3};
use nestrad_common::ends::Ends;
use nestrad_common::geometry;
use nestrad_common::lattice::{Extent, Soup};
use nestrad_proto::v1;
use thiserror::Error;

/// Geometry of a job.
///
/// Inside a block, faces are numbered by their place in the block ("local ends"): the two faces of
/// each local element, then everything that is not a face, in the order of [`Ends`].
pub struct Block {
    /// Where lines run.
    pub(crate) extent: Extent,
    /// Numbering of the whole scene.
    pub(crate) ends: Ends,
    pub(crate) soil: Option<Soil>,
    pub(crate) radius_m: f64,
    pub(crate) soup: Soup,
    /// First local element of each triangle, and their number at the end.
    pub(crate) first: Vec<u32>,
    pub(crate) divisions: Vec<u32>,
    /// Faces of local elements; local ends from here on are not faces.
    pub(crate) local_faces: u32,
    /// What each local end is seen as: its number in the scene.
    pub(crate) seen_as: Vec<u32>,
    /// Whether each local element is on the surface of something solid.
    pub(crate) solid: Vec<bool>,
    /// One-sided area of each local element, m².
    pub(crate) area_m2: Vec<f64>,
    /// Row of each local end; [`Self::rows`] for an end that has none here.
    pub(crate) row: Vec<u32>,
    /// Number of rows.
    pub(crate) rows: usize,
    /// Local ends have the numbers of the scene, and rows have the numbers of ends: a block of the whole
    /// scene.
    whole: bool,
}

/// The mapped soil plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Soil {
    pub(crate) z_m: f64,
    pub(crate) min_m: DVec2,
    pub(crate) cell_m: DVec2,
    pub(crate) cells: [u32; 2],
}

/// Why a block was refused.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum BlockFault {
    /// A message that must be there is not.
    #[error("block without {0}")]
    Missing(&'static str),
    /// Arrays that describe the same triangles differ in length.
    #[error("block lists {found} {what}, expected {expected}")]
    Length {
        /// What is listed.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A number is out of its range.
    #[error("block with {what} out of range")]
    Range {
        /// What is out of range.
        what: &'static str,
    },
}

impl Block {
    /// Checks a block; nothing in it is trusted.
    pub fn new(block: &v1::Block) -> Result<Self, BlockFault> {
        let world = block.world.as_ref().ok_or(BlockFault::Missing("world"))?;
        let min_m = vector(world.min_m.as_ref(), "min_m")?;
        let max_m = vector(world.max_m.as_ref(), "max_m")?;
        require(min_m.cmple(max_m).all(), "extent")?;
        require(world.sphere_radius_m >= 0.0, "sphere_radius_m")?;
        require(
            world.far_bins <= 64 && world.far_levels <= 1 << 16,
            "far field",
        )?;
        let soil = world.soil.as_ref().map(soil_plane).transpose()?;
        let soil_cells = soil.map_or(0, |s| s.cells[0] * s.cells[1]);
        require(world.elements <= 1 << 30, "elements")?;
        let ends = Ends {
            elements: world.elements,
            soil_cells,
            far_levels: world.far_levels,
            far_bins: world.far_bins,
        };

        let count = block.divisions.len();
        same_length("vertex coordinates", block.vertices_m.len(), 9 * count)?;
        same_length("first elements", block.first_element.len(), count)?;
        same_length("owner flags", block.owned.len(), count)?;
        same_length("solid flags", block.solid.len(), count)?;
        require(block.vertices_m.iter().all(|x| x.is_finite()), "vertices_m")?;
        let triangles: Vec<[DVec3; 3]> = block
            .vertices_m
            .chunks_exact(9)
            .map(|c| [0, 3, 6].map(|k| DVec3::new(c[k], c[k + 1], c[k + 2])))
            .collect();

        let mut first = Vec::with_capacity(count + 1);
        let (mut seen_as, mut solid, mut area_m2, mut row) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let mut rows = 0;
        let mut next = 0;
        for (t, &n) in block.divisions.iter().enumerate() {
            let start = block.first_element[t];
            require(
                (1..=nestrad_common::elements::MAX_DIVISIONS).contains(&n),
                "divisions",
            )?;
            require(
                start >= next && u64::from(start) + u64::from(n * n) <= u64::from(world.elements),
                "first_element",
            )?;
            next = start + n * n;
            first.push(area_m2.len() as u32);
            let area = geometry::area(&triangles[t]) / f64::from(n * n);
            for e in start..next {
                area_m2.push(area);
                solid.push(block.solid[t]);
                seen_as.extend([2 * e, 2 * e + 1]);
                for _ in 0..2 {
                    row.push(if block.owned[t] { rows } else { NO_ROW });
                    rows += u32::from(block.owned[t]);
                }
            }
        }
        first.push(area_m2.len() as u32);
        let local_faces = row.len() as u32;
        seen_as.extend(ends.faces()..ends.len() as u32);
        row.resize(seen_as.len(), NO_ROW);
        for &cell in &block.owned_soil_cells {
            require(cell < soil_cells, "owned_soil_cells")?;
            row[(local_faces + cell) as usize] = rows;
            rows += 1;
        }
        for r in &mut row {
            *r = (*r).min(rows);
        }
        let is_own = |(k, &number): (usize, &u32)| number as usize == k;
        let whole = seen_as.iter().enumerate().all(is_own)
            && row[..rows as usize].iter().enumerate().all(is_own);
        Ok(Self {
            whole,
            extent: Extent {
                min_m,
                max_m,
                periodic: world.periodic,
            },
            ends,
            soil,
            radius_m: world.sphere_radius_m,
            soup: Soup::new(triangles),
            first,
            divisions: block.divisions.clone(),
            local_faces,
            seen_as,
            solid,
            area_m2,
            row,
            rows: rows as usize,
        })
    }

    /// Number of ends of the whole scene.
    pub fn ends(&self) -> usize {
        self.ends.len()
    }

    /// The local number of an end that is not a face.
    pub(crate) fn local(&self, end: u32) -> u32 {
        end - self.ends.faces() + self.local_faces
    }

    /// How far away a copy of the scene lies, metres.
    pub(crate) fn shift_m(&self, copy: [i64; 2]) -> DVec3 {
        let size = self.extent.max_m - self.extent.min_m;
        DVec3::new(copy[0] as f64 * size.x, copy[1] as f64 * size.y, 0.0)
    }

    /// Whether a local face belongs to the surface of something solid, outside or inside.
    #[inline]
    pub(crate) fn is_solid(&self, face: u32) -> bool {
        self.solid[face as usize / 2]
    }

    /// Whether a local end is the inside of something solid.
    pub(crate) fn is_inside(&self, local: u32) -> bool {
        local < self.local_faces && local % 2 == 1 && self.is_solid(local)
    }

    /// The row of a local end, and what another is seen as there; `None` where no row is wanted.
    #[inline]
    pub(crate) fn entry(&self, from: u32, seen: u32) -> Option<(u32, u32)> {
        let (row, seen) = if self.whole {
            (from, seen)
        } else {
            (self.row[from as usize], self.seen_as[seen as usize])
        };
        ((row as usize) < self.rows).then_some((row, seen))
    }

    /// Whether rows of a local end are wanted.
    pub(crate) fn has_row(&self, local: u32) -> bool {
        (self.row[local as usize] as usize) < self.rows
    }
}

/// Stands for the place past the rows until their number is known.
const NO_ROW: u32 = u32::MAX;

fn vector(v: Option<&v1::Vector>, name: &'static str) -> Result<DVec3, BlockFault> {
    let v = v.ok_or(BlockFault::Missing(name))?;
    let v = DVec3::new(v.x, v.y, v.z);
    require(v.is_finite(), name)?;
    Ok(v)
}

fn soil_plane(soil: &v1::SoilPlane) -> Result<Soil, BlockFault> {
    let min_m = DVec2::new(soil.min_x_m, soil.min_y_m);
    let cell_m = DVec2::new(soil.cell_x_m, soil.cell_y_m);
    require(min_m.is_finite() && soil.z_m.is_finite(), "soil")?;
    require(
        cell_m.is_finite() && cell_m.cmpgt(DVec2::ZERO).all(),
        "soil cell",
    )?;
    let cells = [soil.cells_x, soil.cells_y];
    require(
        cells.iter().all(|c| (1..=1 << 14).contains(c)),
        "soil cells",
    )?;
    Ok(Soil {
        z_m: soil.z_m,
        min_m,
        cell_m,
        cells,
    })
}

fn require(holds: bool, what: &'static str) -> Result<(), BlockFault> {
    if holds {
        Ok(())
    } else {
        Err(BlockFault::Range { what })
    }
}

fn same_length(what: &'static str, found: usize, expected: usize) -> Result<(), BlockFault> {
    if found == expected {
        Ok(())
    } else {
        Err(BlockFault::Length {
            what,
            found,
            expected,
        })
    }
}
