//! What no plan can be made for, whatever the memory.

use nestrad_common::canopy::Canopy;
use nestrad_common::geometry;
use nestrad_kernel::elements::Elements;
use nestrad_kernel::lattice::DEPTH_OF_TOP;

use super::{PlanError, Scale};

/// The accuracy below which the number of directions would pass a million, percent.
pub const LEAST_ACCURACY_PERCENT: f64 = 0.01;

/// Most copies of the pattern that one triangle may reach into.
const MOST_PATTERNS: f64 = 1e3;

/// Times that a scene may be as high as its pattern is wide: rays cross as many copies of it.
const MOST_WIDTHS: f64 = 100.0;

/// A step in height may be this part of a triangle.
const FINEST_STEP: f64 = 1e-3;

/// Elements have two faces, and faces and soil cells are numbered with 32 bits.
const MOST_ELEMENTS: u64 = 1 << 30;

pub(super) fn check_accuracy(found: f64) -> Result<(), PlanError> {
    let least = LEAST_ACCURACY_PERCENT;
    if found >= least {
        Ok(())
    } else {
        Err(PlanError::Accuracy { least, found })
    }
}

pub(super) fn check_overhang(canopy: &Canopy) -> Result<(), PlanError> {
    let Some(pattern) = canopy.pattern else {
        return Ok(());
    };
    for (triangle, corners) in canopy.corners_m().enumerate() {
        let Some((lo, hi)) = geometry::bounds(&corners) else {
            continue;
        };
        let copies = (hi - lo).truncate() / pattern.size_m + 1.0;
        let patterns = copies.x * copies.y;
        if patterns > MOST_PATTERNS {
            return Err(PlanError::Overhang {
                triangle,
                patterns,
                most: MOST_PATTERNS,
            });
        }
    }
    Ok(())
}

pub(super) fn check_pattern(canopy: &Canopy, scale: &Scale) -> Result<(), PlanError> {
    let Some(pattern) = canopy.pattern else {
        return Ok(());
    };
    let (height_m, width_m) = (scale.height_m, pattern.size_m.min_element());
    if height_m <= MOST_WIDTHS * width_m {
        return Ok(());
    }
    Err(PlanError::Narrow {
        height_m,
        width_m,
        most: MOST_WIDTHS,
    })
}

pub(super) fn check_height(scale: &Scale) -> Result<(), PlanError> {
    let step_m = scale.height_m / f64::from(DEPTH_OF_TOP);
    let triangle_m = scale.triangle_area_m2.sqrt();
    if step_m > FINEST_STEP * triangle_m && triangle_m > 0.0 {
        return Err(PlanError::Height {
            height_m: scale.height_m,
            step_m,
            triangle_m,
        });
    }
    Ok(())
}

pub(super) fn check_elements(canopy: &Canopy, max_edge_m: f64) -> Result<(), PlanError> {
    let (found, most) = (
        Elements::count(canopy.corners_m(), max_edge_m),
        MOST_ELEMENTS,
    );
    if found <= most {
        Ok(())
    } else {
        Err(PlanError::Elements { found, most })
    }
}
