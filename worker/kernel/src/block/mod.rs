//! A block, checked and made ready for the kernel.

mod fault;
mod numbering;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::DVec3;

use crate::above::Above;
use crate::elements::{Elements, MAX_DIVISIONS};
use crate::ends::Ends;
use crate::far_grid::SharedFarGrid;
use crate::ground::Ground;
use crate::lattice::{Extent, Soup};
use crate::soil::SoilGrid;
use crate::world::World;

pub use fault::BlockFault;
use fault::{require, same_length};
use numbering::Numbering;

/// All of a block but its triangles.
#[derive(Clone, Debug)]
pub struct BlockFrame {
    /// What it shares with all blocks.
    pub world: World,
    /// All triangles, those that are alike and follow one another together.
    pub runs: Vec<TriangleRun>,
    /// The soil cells whose rows are wanted.
    pub owned_soil: Vec<CellRun>,
}

/// Triangles that follow one another, in a block and, but for the first, in the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TriangleRun {
    /// How many.
    pub triangles: u32,
    /// Elements of the scene between the triangle before, or the first element, and this run.
    pub skipped_elements: u32,
    /// Each triangle is cut into `divisions * divisions` elements.
    pub divisions: u32,
    /// Whether rows are wanted for their faces.
    pub owned: bool,
    /// Whether the lower face of a triangle is the inside of something solid: a line that enters and leaves
    /// it passes what is buried there, which neither gets nor gives light.
    pub solid: bool,
}

/// Soil cells that follow one another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CellRun {
    /// How many.
    pub cells: u32,
    /// Cells between the run before, or the first cell, and this one.
    pub skipped_cells: u32,
}

/// Geometry of a job; clones share it.
///
/// Inside a block, faces are numbered by their place in the block ("local ends"): the two faces of
/// each local element, then everything that is not a face, in the order of [`Ends`].
#[derive(Clone)]
pub struct Block {
    /// Where lines run.
    pub(crate) extent: Extent,
    /// Numbering of the whole scene.
    pub(crate) ends: Ends,
    pub(crate) soil: Option<SoilGrid>,
    /// The same with what lies around it.
    pub(crate) ground: Option<Ground>,
    pub(crate) radius_m: f64,
    pub(crate) far: Option<SharedFarGrid>,
    pub(crate) soup: Arc<Soup>,
    /// The local elements.
    pub(crate) elements: Arc<Elements>,
    flags: Arc<Flags>,
    numbering: Arc<Numbering>,
}

/// What is told of each local element.
#[derive(Default)]
struct Flags {
    /// Whether it is on the surface of something solid.
    solid: Vec<bool>,
    /// Whether the soil cuts it.
    cut_by_soil: Vec<bool>,
}

impl Block {
    /// Checks a block; nothing in its frame is trusted, but for its sizes: see [`Demand`](crate::Demand).
    pub fn new(frame: &BlockFrame, soup: Arc<Soup>) -> Result<Self, BlockFault> {
        let World {
            extent,
            elements: of_scene,
            soil,
            radius_m,
            far,
        } = &frame.world;
        let (min_m, max_m) = (extent.min_m, extent.max_m);
        require(min_m.is_finite() && max_m.is_finite(), "extent")?;
        require(min_m.cmple(max_m).all(), "extent")?;
        require(*radius_m >= 0.0, "sphere_radius_m")?;
        require(*of_scene <= 1 << 30, "elements")?;
        soil.as_ref().map_or(Ok(()), check_soil)?;
        let ends = frame.world.ends();
        let len = elements_of_runs(&frame.runs, soup.len(), *of_scene)?;
        let numbering = Numbering::new(frame, &ends, len)?;

        let mut elements = Elements::with_room(soup.len());
        let mut solid = Vec::with_capacity(len);
        for run in &frame.runs {
            for _ in 0..run.triangles {
                elements.push(run.divisions);
            }
            solid.resize(elements.len(), run.solid);
        }
        let mut block = Self {
            extent: *extent,
            ends,
            soil: *soil,
            ground: Ground::of(&frame.world),
            radius_m: *radius_m,
            far: far.clone(),
            soup,
            elements: Arc::new(elements),
            flags: Arc::default(),
            numbering: Arc::new(numbering),
        };
        block.flags = Arc::new(Flags {
            solid,
            cut_by_soil: block.find_cut_by_soil(),
        });
        Ok(block)
    }

    /// The same block with a sphere of another radius, metres.
    #[must_use]
    pub fn within(&self, radius_m: f64) -> Self {
        Self {
            radius_m,
            ..self.clone()
        }
    }

    /// The elements that its triangles are cut into.
    pub fn elements(&self) -> &Arc<Elements> {
        &self.elements
    }

    /// The triangles.
    pub fn soup(&self) -> &Arc<Soup> {
        &self.soup
    }

    fn find_cut_by_soil(&self) -> Vec<bool> {
        let mut cut = vec![false; self.elements.len()];
        let Some(soil) = self.soil else { return cut };
        for (t, corners) in self.soup.triangles().enumerate() {
            if corners.iter().all(|corner| corner.z >= soil.z_m) {
                continue;
            }
            for local in self.elements.of(t) {
                let part = matches!(self.above_soil(&corners, t, local), Above::Part(_));
                cut[local as usize] = part;
            }
        }
        cut
    }

    /// What of a local element, a piece of a triangle with these corners, stands above the soil plane.
    pub(crate) fn above_soil(&self, corners: &[DVec3; 3], triangle: usize, local: u32) -> Above {
        let Some(soil) = &self.soil else {
            return Above::Whole;
        };
        let first = self.elements.first[triangle];
        let piece = (local - first, self.elements.divisions[triangle]);
        Above::of(corners, piece, soil.z_m)
    }

    /// Number of ends of the whole scene.
    pub fn ends(&self) -> usize {
        self.ends.len()
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.numbering.rows as usize
    }

    /// The local number of an end that is not a face.
    pub(crate) fn local(&self, end: u32) -> u32 {
        end - self.ends.faces() + self.numbering.local_faces
    }

    /// Number of local ends.
    #[cfg(test)]
    fn local_ends(&self) -> u32 {
        self.numbering.local_ends
    }

    /// How far away a copy of the scene lies, metres.
    pub(crate) fn shift_m(&self, copy: [i64; 2]) -> DVec3 {
        let size = self.extent.max_m - self.extent.min_m;
        DVec3::new(copy[0] as f64 * size.x, copy[1] as f64 * size.y, 0.0)
    }

    /// Whether a local face belongs to the surface of something solid, outside or inside.
    #[inline]
    pub(crate) fn is_solid(&self, face: u32) -> bool {
        self.flags.solid[face as usize / 2]
    }

    /// Whether the soil cuts the element of a local face.
    #[inline]
    pub(crate) fn is_cut_by_soil(&self, face: u32) -> bool {
        self.flags.cut_by_soil[face as usize / 2]
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
    runs: &[TriangleRun],
    triangles: usize,
    of_scene: u32,
) -> Result<usize, BlockFault> {
    let listed = runs.iter().map(|run| u64::from(run.triangles)).sum();
    same_length("triangles in runs", listed, triangles as u64)?;
    let (mut elements, mut end) = (0, 0u64);
    for run in runs {
        require((1..=MAX_DIVISIONS).contains(&run.divisions), "divisions")?;
        let here = u64::from(run.triangles) * u64::from(run.divisions.pow(2));
        elements += here;
        // sums of numbers below 2^32 that are stopped at the first one beyond the scene's: none overflows
        end += u64::from(run.skipped_elements) + here;
        require(end <= u64::from(of_scene), "elements")?;
    }
    Ok(elements as usize)
}

fn check_soil(soil: &SoilGrid) -> Result<(), BlockFault> {
    require(soil.min_m.is_finite() && soil.z_m.is_finite(), "soil")?;
    let proper = soil.cell_m.is_finite() && soil.cell_m.min_element() > 0.0;
    require(proper, "soil cell")?;
    let few = soil.cells.iter().all(|c| (1..=1 << 14).contains(c));
    require(few, "soil cells")
}
