//! A block, checked and made ready for the kernel.

mod fault;
mod numbering;

use glam::{DVec2, DVec3};
use nestrad_common::above::Above;
use nestrad_common::elements::MAX_DIVISIONS;
use nestrad_common::ends::Ends;
use nestrad_common::lattice::{Extent, Soup};
use nestrad_proto::{mesh, v1};

pub use fault::BlockFault;
use fault::{require, same_length};
use numbering::Numbering;

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
    /// Whether each local element is on the surface of something solid.
    pub(crate) solid: Vec<bool>,
    /// Whether the soil cuts each local element.
    pub(crate) cut_by_soil: Vec<bool>,
    numbering: Numbering,
}

/// The mapped soil plane.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Soil {
    pub(crate) z_m: f64,
    pub(crate) min_m: DVec2,
    pub(crate) cell_m: DVec2,
    pub(crate) cells: [u32; 2],
}

impl Block {
    /// Checks a block; nothing in it is trusted, but for its sizes: see [`Demand::of_message`](crate::Demand::of_message).
    pub fn new(block: &v1::Block) -> Result<Self, BlockFault> {
        let mesh = block.mesh.as_ref().ok_or(BlockFault::Missing("mesh"))?;
        Self::of_triangles(block, mesh::unpack(mesh)?)
    }

    /// Checks a block whose triangles are at hand: its mesh is not looked at.
    pub fn of_triangles(block: &v1::Block, triangles: Vec<[DVec3; 3]>) -> Result<Self, BlockFault> {
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
        require(world.elements <= 1 << 30, "elements")?;
        let ends = Ends {
            elements: world.elements,
            soil_cells: soil.map_or(0, |s| s.cells[0] * s.cells[1]),
            far_levels: world.far_levels,
            far_bins: world.far_bins,
        };
        let elements = elements_of_runs(block, triangles.len(), world.elements)?;
        let numbering = Numbering::new(block, &ends, elements)?;

        let (mut first, mut divisions) = (
            Vec::with_capacity(triangles.len() + 1),
            Vec::with_capacity(triangles.len()),
        );
        let mut solid = Vec::with_capacity(elements);
        for run in &block.runs {
            let (from, pieces) = (solid.len() as u32, run.divisions.pow(2));
            first.extend((0..run.triangles).map(|t| from + t * pieces));
            divisions.resize(first.len(), run.divisions);
            solid.resize(solid.len() + (run.triangles * pieces) as usize, run.solid);
        }
        first.push(elements as u32);
        let mut block = Self {
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
            solid,
            cut_by_soil: vec![false; elements],
            numbering,
        };
        block.find_cut_by_soil();
        Ok(block)
    }

    fn find_cut_by_soil(&mut self) {
        let Some(soil) = self.soil else { return };
        for t in 0..self.divisions.len() {
            let corners = &self.soup.triangles()[t];
            if corners.iter().all(|corner| corner.z >= soil.z_m) {
                continue;
            }
            for local in self.first[t]..self.first[t + 1] {
                let cut = matches!(self.above_soil(t, local), Above::Part(_));
                self.cut_by_soil[local as usize] = cut;
            }
        }
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

    /// Number of rows.
    pub(crate) fn rows(&self) -> usize {
        self.numbering.rows as usize
    }

    /// Number of local ends.
    pub(crate) fn local_ends(&self) -> u32 {
        self.numbering.local_ends
    }

    /// The local number of an end that is not a face.
    pub(crate) fn local(&self, end: u32) -> u32 {
        end - self.ends.faces() + self.numbering.local_faces
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

    /// Whether a local end is a face of an element.
    #[inline]
    pub(crate) fn is_face(&self, local: u32) -> bool {
        local < self.numbering.local_faces
    }

    /// Whether a local end is the inside of something solid.
    pub(crate) fn is_inside(&self, local: u32) -> bool {
        self.is_face(local) && local % 2 == 1 && self.is_solid(local)
    }

    /// The row of a local end, where one is wanted.
    #[inline]
    pub(crate) fn row_of(&self, local: u32) -> Option<u32> {
        self.numbering.row(local)
    }

    /// What a local end is seen as.
    #[inline]
    pub(crate) fn number_of(&self, local: u32) -> u32 {
        self.numbering.number(local)
    }
}

/// Elements of all runs, which are checked to be of so many triangles, and of a scene of so many elements.
fn elements_of_runs(
    block: &v1::Block,
    triangles: usize,
    of_scene: u32,
) -> Result<usize, BlockFault> {
    let listed = block.runs.iter().map(|run| u64::from(run.triangles)).sum();
    same_length("triangles in runs", listed, triangles as u64)?;
    let (mut elements, mut end) = (0, 0u64);
    for run in &block.runs {
        require((1..=MAX_DIVISIONS).contains(&run.divisions), "divisions")?;
        let here = u64::from(run.triangles) * u64::from(run.divisions.pow(2));
        elements += here;
        // sums of numbers below 2^32 that are stopped at the first one beyond the scene's: none overflows
        end += u64::from(run.skipped_elements) + here;
        require(end <= u64::from(of_scene), "elements")?;
    }
    Ok(elements as usize)
}

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

#[cfg(test)]
mod tests;
