//! The canopy as it is computed: in an order of its own, cut into elements, all that can be seen numbered. There
//! is no light in it.

mod extent;
mod order;

use std::sync::Arc;

use glam::DVec3;
use nestrad_common::canopy::{Canopy, Kind, Material, Pattern};
use nestrad_common::geometry;
use nestrad_common::optics::{Band, LeafOptics, Optics};
use nestrad_kernel::above::Above;
use nestrad_kernel::block::{BlockFrame, CellRun, TriangleRun};
use nestrad_kernel::elements::Elements;
use nestrad_kernel::ends::Ends;
use nestrad_kernel::far_grid::SharedFarGrid;
use nestrad_kernel::lattice::Soup;
use nestrad_kernel::soil::SoilGrid;
use nestrad_kernel::world::World;
use nestrad_kernel::{Block, BlockFault};

pub use extent::{bounds_of, extent_of};
pub use order::Order;
pub(crate) use order::back;

/// How finely a canopy is cut, and how far near exchange reaches.
#[derive(Clone, Debug)]
pub struct Cut {
    /// Longest edge of an element, metres.
    pub max_edge_m: f64,
    /// Side of a soil cell, metres, about.
    pub soil_cell_m: f64,
    /// Radius of the sphere of near exchange, metres; infinite for plain radiosity.
    pub radius_m: f64,
    /// What stands for all beyond the sphere, where anything does.
    pub far: Option<SharedFarGrid>,
}

/// What stays the same for all lights. Triangles, organs and materials have numbers of the frame's own: see
/// [`Order`].
pub struct Frame {
    /// Where things stand in the canopy.
    pub order: Order,
    /// Organ of each triangle.
    pub organ: Vec<u32>,
    /// Material of each triangle.
    pub material: Vec<u32>,
    /// Number of organs.
    pub organs: usize,
    /// Names of what triangles are made of.
    pub materials: Vec<String>,
    /// What each material counts as.
    pub kinds: Vec<Kind>,
    /// Whether the lower faces of each material are the inside of something solid.
    solid: Vec<bool>,
    /// The rectangle on which the canopy repeats, if it does.
    pub pattern: Option<Pattern>,
    /// The triangle of each element.
    pub triangle_of_element: Vec<u32>,
    /// One-sided area of each element, m².
    pub area_m2: Vec<f64>,
    /// The numbers of faces, soil cells and so on.
    pub ends: Ends,
    /// The box, the soil plane and the sphere.
    pub world: World,
    block: Block,
}

impl Frame {
    /// Sorts a canopy, cuts it into elements and numbers what can be seen.
    pub fn new(canopy: &Canopy, cut: &Cut) -> Result<Self, BlockFault> {
        let order = Order::of(canopy);
        let soup: Soup = order.triangles(canopy).map(|t| t.corners_m).collect();
        let elements = Elements::divide(soup.triangles(), cut.max_edge_m);
        let extent = extent_of(canopy);
        let soil = canopy.soil_z_m;
        let world = World {
            extent,
            elements: elements.len() as u32,
            soil: soil.map(|z_m| SoilGrid::over(&extent, z_m, cut.soil_cell_m)),
            radius_m: cut.radius_m,
            far: cut.far.clone(),
        };
        let (organ, material) = order.numbers(canopy);
        let materials: Vec<String> = canopy.materials.iter().map(Material::to_string).collect();
        let materials = order.by_material(&materials);
        let kinds = order.by_material(&canopy.kinds());
        let solid = canopy.solids().solid;
        let solid: Vec<bool> = order.triangle.iter().map(|&t| solid[t as usize]).collect();
        let mut area_m2 = Vec::with_capacity(elements.len());
        for (triangle, &n) in soup.triangles().zip(&elements.divisions) {
            let pieces = n * n;
            let area = geometry::area(&triangle) / f64::from(pieces);
            area_m2.extend(std::iter::repeat_n(area, pieces as usize));
        }
        let runs = (0..soup.len()).map(|t| TriangleRun {
            triangles: 1,
            skipped_elements: 0,
            divisions: elements.divisions[t],
            owned: true,
            solid: solid[t],
        });
        let ends = world.ends();
        let whole = BlockFrame {
            world: world.clone(),
            runs: joined(runs),
            owned_soil: all_cells(ends.soil_cells),
        };
        let block = Block::new(&whole, Arc::new(soup))?;
        Ok(Self {
            organs: canopy.organs.len(),
            pattern: canopy.pattern,
            triangle_of_element: elements.triangle_of_element(),
            order,
            organ,
            material,
            materials,
            kinds,
            solid,
            area_m2,
            ends,
            world,
            block,
        })
    }

    /// Bytes that it takes, about.
    pub fn bytes(&self) -> u64 {
        /// Vertices, numbers, flags.
        const OF_A_TRIANGLE: u64 = 100;
        /// Area and triangle.
        const OF_AN_ELEMENT: u64 = 12;
        OF_A_TRIANGLE * self.organ.len() as u64 + OF_AN_ELEMENT * self.area_m2.len() as u64
    }

    /// The whole scene as one block.
    pub fn block(&self) -> &Block {
        &self.block
    }

    /// The triangles.
    pub fn soup(&self) -> &Soup {
        self.block.soup()
    }

    /// How triangles are cut.
    pub fn elements(&self) -> &Elements {
        self.block.elements()
    }

    /// Optics whose materials stand in the frame's order.
    pub fn ordered(&self, optics: &Optics) -> Optics {
        self.order.optics(optics)
    }

    /// Whether the lower face of a triangle is the inside of something solid: what is buried there gets and gives
    /// no light.
    pub fn is_solid(&self, triangle: usize) -> bool {
        self.solid[triangle]
    }

    /// What a triangle counts as.
    pub fn kind(&self, triangle: usize) -> Kind {
        self.kinds[self.material[triangle] as usize]
    }

    /// Whether each organ is of a plant: some of it is leaf or stem.
    pub fn plants(&self) -> Vec<bool> {
        let mut plant = vec![false; self.organs];
        for (t, &organ) in self.organ.iter().enumerate() {
            plant[organ as usize] |= self.kind(t).is_plant();
        }
        plant
    }

    /// Area of a row (a face of an element, or a soil cell), m².
    pub fn row_area_m2(&self, row: usize) -> f64 {
        match self.area_m2.get(row / 2) {
            Some(&area) => area,
            None => self.world.soil.map_or(0.0, |s| s.cell_area_m2()),
        }
    }

    /// The share of a row (a face of an element, or a soil cell) above the soil, where the soil cuts it. Of what it
    /// does not cut, 1: the lines of a row that lies under the soil tell that it is buried.
    pub fn share_above_soil(&self, row: usize) -> f64 {
        let (Some(&t), Some(soil)) = (self.triangle_of_element.get(row / 2), &self.world.soil)
        else {
            return 1.0;
        };
        let (corners, piece) = self.piece(row / 2, t);
        match Above::of(&corners, piece, soil.z_m) {
            Above::Part(part) => part.share,
            Above::Whole | Above::Nothing => 1.0,
        }
    }

    /// The corners of an element's triangle, and which of how many pieces (along an edge) of it the element is.
    pub fn piece(&self, element: usize, triangle: u32) -> ([DVec3; 3], (u32, u32)) {
        let (t, elements) = (triangle as usize, self.elements());
        let piece = (element as u32 - elements.first[t], elements.divisions[t]);
        (self.soup().triangle(t), piece)
    }

    /// Number of rows: faces and soil cells.
    pub fn rows(&self) -> usize {
        self.ends.rows() as usize
    }

    /// Sums powers of elements, which are added one after the other, over the elements of each organ.
    pub fn sum_by_organ<const N: usize>(
        &self,
        band: &Band,
        power_W: impl Fn(usize, &LeafOptics) -> [f64; N],
    ) -> Vec<f64> {
        let mut sums = vec![0.0; self.organs];
        self.add_by_organ(band, &mut sums, power_W);
        sums
    }

    /// The same, added to the sums of organs.
    pub fn add_by_organ<const N: usize>(
        &self,
        band: &Band,
        sums_W: &mut [f64],
        power_W: impl Fn(usize, &LeafOptics) -> [f64; N],
    ) {
        for (e, &t) in self.triangle_of_element.iter().enumerate() {
            let t = t as usize;
            let sum = &mut sums_W[self.organ[t] as usize];
            for power in power_W(e, &band.materials[self.material[t] as usize]) {
                *sum += power;
            }
        }
    }
}

/// Runs of one triangle each, those that go on with the one before joined to it.
pub(crate) fn joined(runs: impl Iterator<Item = TriangleRun>) -> Vec<TriangleRun> {
    let alike = |run: &TriangleRun| (run.divisions, run.owned, run.solid);
    let mut all: Vec<TriangleRun> = Vec::new();
    for run in runs {
        match all.last_mut() {
            Some(last) if run.skipped_elements == 0 && alike(last) == alike(&run) => {
                last.triangles += run.triangles;
            }
            _ => all.push(run),
        }
    }
    all
}

fn all_cells(cells: u32) -> Vec<CellRun> {
    let run = CellRun {
        cells,
        skipped_cells: 0,
    };
    if cells > 0 { vec![run] } else { Vec::new() }
}
