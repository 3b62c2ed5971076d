//! The scene as the solve sees it: elements, the box that lines run in, the soil map, and the numbers
//! of all that can be seen.

use glam::{DVec2, DVec3};
use nestrad_common::above::Above;
use nestrad_common::elements::Elements;
use nestrad_common::ends::Ends;
use nestrad_common::geometry;
use nestrad_common::lattice::{Extent, Soup};
use nestrad_common::problem::Problem;
use nestrad_common::scene::{Material, Scene};

/// What stays the same for all stages of a solve.
#[derive(Clone, Debug)]
pub struct World {
    /// The triangles.
    pub soup: Soup,
    /// How triangles are cut.
    pub elements: Elements,
    /// The triangle of each element.
    pub triangle_of_element: Vec<u32>,
    /// Whether the lower face of each triangle is the inside of something solid: what is buried there
    /// gets and gives no light.
    pub solid: Vec<bool>,
    /// Where lines run.
    pub extent: Extent,
    /// The numbers of faces, soil cells and so on.
    pub ends: Ends,
    /// The soil plane's map.
    pub soil: Option<SoilGrid>,
    /// Radius of the sphere of near exchange, metres; infinite for plain radiosity.
    pub radius_m: f64,
}

/// Cells of the soil plane; cell (ix, iy) is number `iy * nx + ix`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoilGrid {
    /// Height of the plane, metres.
    pub z_m: f64,
    /// Lower corner of cell (0, 0), metres.
    pub min_m: DVec2,
    /// Extent of a cell, metres.
    pub cell_m: DVec2,
    /// Cells along x.
    pub nx: u32,
    /// Cells along y.
    pub ny: u32,
}

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
            nx: n.x as u32,
            ny: n.y as u32,
        }
    }

    /// Area of a cell, m².
    pub fn cell_area_m2(&self) -> f64 {
        self.cell_m.x * self.cell_m.y
    }

    /// Number of cells.
    pub fn cells(&self) -> u32 {
        self.nx * self.ny
    }

    /// The cell under a point; `None` beyond the map of an open scene.
    pub fn cell_at(&self, at: DVec2, periodic: bool) -> Option<u32> {
        let k = ((at - self.min_m) / self.cell_m).floor();
        let n = DVec2::new(f64::from(self.nx), f64::from(self.ny));
        // rem_euclid may return n itself for tiny negative numbers
        let k = if periodic {
            (k - (k / n).floor() * n).min(n - 1.0)
        } else {
            k
        };
        let inside = k.cmpge(DVec2::ZERO).all() && k.cmplt(n).all();
        inside.then(|| k.y as u32 * self.nx + k.x as u32)
    }
}

impl World {
    /// Cuts the scene into elements with edges of at most `max_edge_m`, lays out the soil map in cells
    /// of about `soil_cell_m`, and numbers what can be seen.
    pub fn new(
        scene: &Scene,
        max_edge_m: f64,
        soil_cell_m: f64,
        radius_m: f64,
        far: (u32, u32),
    ) -> Self {
        let extent = extent_of(scene);
        let soil = scene
            .soil_z_m
            .map(|z_m| SoilGrid::over(&extent, z_m, soil_cell_m));
        let elements = Elements::divide(scene, max_edge_m);
        let ends = Ends {
            elements: elements.len() as u32,
            soil_cells: soil.map_or(0, |s| s.cells()),
            far_levels: far.0,
            far_bins: far.1,
        };
        Self {
            soup: Soup::new(scene.triangles.clone()),
            // CAN's opaque organs (leaf 0) are the surfaces of solid stems
            solid: scene
                .material
                .iter()
                .map(|&m| matches!(scene.materials[m as usize], Material::Stem { .. }))
                .collect(),
            triangle_of_element: elements.triangle_of_element(),
            extent,
            elements,
            ends,
            soil,
            radius_m,
        }
    }

    /// Area of a row (a face of an element, or a soil cell), m².
    pub fn row_area_m2(&self, row: u32) -> f64 {
        match self.elements.area_m2.get(row as usize / 2) {
            Some(&area) => area,
            None => self.soil.map_or(0.0, |s| s.cell_area_m2()),
        }
    }

    /// The share of a row (a face of an element, or a soil cell) above the soil, where the soil cuts it. Of what it
    /// does not cut, 1: the lines of a row that lies under the soil tell that it is buried.
    pub fn share_above_soil(&self, row: u32) -> f64 {
        let element = row / 2;
        let (Some(&t), Some(soil)) = (self.triangle_of_element.get(element as usize), &self.soil)
        else {
            return 1.0;
        };
        let piece = (
            element - self.elements.first[t as usize],
            self.elements.divisions[t as usize],
        );
        match Above::of(&self.soup.triangles()[t as usize], piece, soil.z_m) {
            Above::Part(part) => part.share,
            Above::Whole | Above::Nothing => 1.0,
        }
    }

    /// Area of the pattern, or of the box around an open scene, m².
    pub fn ground_area_m2(&self) -> f64 {
        let size = self.extent.max_m - self.extent.min_m;
        size.x * size.y
    }

    /// Number of rows: faces and soil cells.
    pub fn rows(&self) -> usize {
        self.ends.rows() as usize
    }
}

/// The corners of a scene's box, soil included.
pub fn bounds_of(scene: &Scene) -> (DVec3, DVec3) {
    let (mut min, mut max) =
        geometry::bounds(scene.triangles.iter().flatten()).unwrap_or((DVec3::ZERO, DVec3::ZERO));
    if let Some(z) = scene.soil_z_m {
        (min.z, max.z) = (min.z.min(z), max.z.max(z));
    }
    (min, max)
}

/// How far below the soil lines run on, in parts of the height above it: far enough to tell what is buried
/// from the soil.
const BELOW_SOIL: f64 = 1e-3;

/// Where the lines of a scene run.
pub fn extent_of(scene: &Scene) -> Extent {
    let (mut min, mut max) = bounds_of(scene);
    if let Some(z) = scene.soil_z_m.filter(|&z| z < max.z) {
        min.z = min.z.max(z - BELOW_SOIL * (max.z - z));
    }
    match scene.pattern {
        Some(p) => {
            (min.x, min.y) = p.min_m.into();
            (max.x, max.y) = (p.min_m + p.size_m).into();
        }
        // The soil of an open scene is mapped as far from the plants as these are high; beyond,
        // it is taken as unshaded.
        None if scene.soil_z_m.is_some() => {
            let margin = DVec2::splat(max.z - min.z).extend(0.0);
            (min, max) = (min - margin, max + margin);
        }
        None => {}
    }
    Extent {
        min_m: min,
        max_m: max,
        periodic: scene.pattern.is_some(),
    }
}

/// Most soil cells along a side.
const MOST_CELLS: u32 = 1 << 11;

/// Radiosity of the unshaded soil beyond the map of an open scene, W m⁻².
pub fn outer_soil_radiosity_W_m2(problem: &Problem, band: usize) -> f64 {
    let incoming: f64 = problem
        .sources
        .iter()
        .map(|s| s.irradiance_W_m2[band])
        .sum();
    problem.bands[band].soil_albedo * incoming
}

/// Whether each triangle is soil.
pub fn is_soil(scene: &Scene) -> Vec<bool> {
    scene
        .material
        .iter()
        .map(|&m| scene.materials[m as usize] == Material::Soil)
        .collect()
}
