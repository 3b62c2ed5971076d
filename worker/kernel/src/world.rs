//! What all jobs of a solve share: the box that lines run in, and the numbers of all that can be seen.

use crate::ends::Ends;
use crate::far_grid::SharedFarGrid;
use crate::lattice::Extent;
use crate::soil::SoilGrid;

/// What all jobs of a solve share.
#[derive(Clone, Debug)]
pub struct World {
    /// Where lines run.
    pub extent: Extent,
    /// Elements of the whole scene.
    pub elements: u32,
    /// The soil plane's map; `None` for a black void below.
    pub soil: Option<SoilGrid>,
    /// Radius of the sphere of near exchange, metres; infinite for plain radiosity.
    pub radius_m: f64,
    /// What stands for all beyond the sphere, where anything does.
    pub far: Option<SharedFarGrid>,
}

impl World {
    /// The numbers of all that can be seen.
    pub fn ends(&self) -> Ends {
        Ends {
            elements: self.elements,
            soil_cells: self.soil.map_or(0, |soil| soil.len()),
            far_ends: self.far.as_ref().map_or(0, |far| far.len()),
            outer_zones: self.outer_soil().map_or(0, |outer| outer.len()),
        }
    }

    /// Area of the pattern, or of the box around an open scene, m².
    pub fn ground_area_m2(&self) -> f64 {
        let size = self.extent.max_m - self.extent.min_m;
        size.x * size.y
    }
}
