//! A block, checked and made ready for the kernel.

use glam::{DVec2, DVec3};
use nestrad_common::above::Above;
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
    /// Whether the soil cuts each local element.
    pub(crate) cut_by_soil: Vec<bool>,
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
        found: u64,
        /// How many there should be.
        expected: u64,
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

        let triangles = triangles(&block.vertices_m, &block.corners)?;
        let count = triangles.len();
        let listed = block.runs.iter().map(|run| u64::from(run.triangles)).sum();
        same_length("triangles in runs", listed, count as u64)?;
        let mut divisions = Vec::with_capacity(count);

        let mut first = Vec::with_capacity(count + 1);
        let pieces = |run: &v1::TriangleRun| {
            u64::from(run.triangles).saturating_mul(u64::from(run.divisions).pow(2))
        };
        let elements = block.runs.iter().map(pieces).fold(0, u64::saturating_add);
        require(elements <= u64::from(world.elements), "elements")?;
        let elements = elements as usize;
        let (mut solid, mut area_m2) = (Vec::with_capacity(elements), Vec::with_capacity(elements));
        let local_ends = 2 * elements + ends.len() - ends.faces() as usize;
        let (mut seen_as, mut row) = (
            Vec::with_capacity(local_ends),
            Vec::with_capacity(local_ends),
        );
        let mut rows = 0;
        let mut next = 0u32;
        for run in &block.runs {
            let n = run.divisions;
            require(
                (1..=nestrad_common::elements::MAX_DIVISIONS).contains(&n),
                "divisions",
            )?;
            let end = u64::from(next)
                + u64::from(run.skipped_elements)
                + u64::from(run.triangles) * u64::from(n * n);
            require(end <= u64::from(world.elements), "elements")?;
            next += run.skipped_elements;
            for _ in 0..run.triangles {
                let triangle = &triangles[divisions.len()];
                divisions.push(n);
                first.push(area_m2.len() as u32);
                let area = geometry::area(triangle) / f64::from(n * n);
                for e in next..next + n * n {
                    area_m2.push(area);
                    solid.push(run.solid);
                    seen_as.extend([2 * e, 2 * e + 1]);
                    for _ in 0..2 {
                        row.push(if run.owned { rows } else { NO_ROW });
                        rows += u32::from(run.owned);
                    }
                }
                next += n * n;
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
        let mut block = Self {
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
            divisions,
            local_faces,
            seen_as,
            solid,
            cut_by_soil: Vec::new(),
            area_m2,
            row,
            rows: rows as usize,
        };
        let mut cut_by_soil = vec![false; elements];
        for t in 0..count {
            for local in block.first[t]..block.first[t + 1] {
                cut_by_soil[local as usize] = matches!(block.above_soil(t, local), Above::Part(_));
            }
        }
        block.cut_by_soil = cut_by_soil;
        Ok(block)
    }

    /// What of a local element, a piece of a triangle, stands above the soil plane.
    pub(crate) fn above_soil(&self, triangle: usize, local: u32) -> Above {
        let (corners, Some(soil)) = (&self.soup.triangles()[triangle], &self.soil) else {
            return Above::Whole;
        };
        let piece = (local - self.first[triangle], self.divisions[triangle]);
        Above::of(corners, piece, soil.z_m)
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

    /// The row of a local end, where one is wanted.
    #[inline]
    pub(crate) fn row_of(&self, local: u32) -> Option<u32> {
        let row = if self.whole {
            local
        } else {
            self.row[local as usize]
        };
        ((row as usize) < self.rows).then_some(row)
    }

    /// What a local end is seen as.
    #[inline]
    pub(crate) fn number_of(&self, local: u32) -> u32 {
        if self.whole {
            local
        } else {
            self.seen_as[local as usize]
        }
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

fn same_length(what: &'static str, found: u64, expected: u64) -> Result<(), BlockFault> {
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

/// Triangles from vertices that are named when they come first, and by how far back they are afterwards.
fn triangles(coordinates_m: &[f64], corners: &[u32]) -> Result<Vec<[DVec3; 3]>, BlockFault> {
    let vertices: Vec<DVec3> = coordinates_m
        .chunks_exact(3)
        .map(|c| DVec3::new(c[0], c[1], c[2]))
        .collect();
    require(vertices.iter().all(|v| v.is_finite()), "vertices_m")?;
    let mut used = 0;
    let mut vertex = |back: u32| {
        used += usize::from(back == 0);
        let number = if back == 0 {
            used.checked_sub(1)
        } else {
            used.checked_sub(back as usize)
        };
        number.and_then(|n| vertices.get(n)).copied()
    };
    let mut triangles = Vec::with_capacity(corners.len() / 3);
    for of in corners.chunks_exact(3) {
        let [Some(a), Some(b), Some(c)] = [vertex(of[0]), vertex(of[1]), vertex(of[2])] else {
            return Err(BlockFault::Range { what: "corners" });
        };
        triangles.push([a, b, c]);
    }
    let whole = |what, length: usize| same_length(what, length as u64, (length / 3 * 3) as u64);
    whole("corners", corners.len())?;
    whole("coordinates", coordinates_m.len())?;
    same_length("vertices", vertices.len() as u64, used as u64)?;
    Ok(triangles)
}

#[cfg(test)]
mod tests;
