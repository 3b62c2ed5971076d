//! The box that the lines of a scene run in.

use glam::{DVec2, DVec3};
use nestrad_common::canopy::Canopy;
use nestrad_kernel::lattice::Extent;

/// The corners of a scene's box, soil included.
pub fn bounds_of(canopy: &Canopy) -> (DVec3, DVec3) {
    let (mut min, mut max) = canopy.bounds_m();
    if let Some(z) = canopy.soil_z_m {
        (min.z, max.z) = (min.z.min(z), max.z.max(z));
    }
    (min, max)
}

/// How far below the soil lines run on, in parts of the height above it: far enough to tell what is buried
/// from the soil.
const BELOW_SOIL: f64 = 1e-3;

/// Where the lines of a scene run.
pub fn extent_of(canopy: &Canopy) -> Extent {
    let (mut min, mut max) = bounds_of(canopy);
    if let Some(z) = canopy.soil_z_m.filter(|&z| z < max.z) {
        min.z = min.z.max(z - BELOW_SOIL * (max.z - z));
    }
    match canopy.pattern {
        Some(p) => {
            (min.x, min.y) = p.min_m.into();
            (max.x, max.y) = (p.min_m + p.size_m).into();
        }
        // The soil of an open scene is mapped as far from the plants as these are high; beyond,
        // it is taken as unshaded.
        None if canopy.soil_z_m.is_some() => {
            let margin = DVec2::splat(max.z - min.z).extend(0.0);
            (min, max) = (min - margin, max + margin);
        }
        None => {}
    }
    Extent {
        min_m: min,
        max_m: max,
        periodic: canopy.pattern.is_some(),
    }
}
