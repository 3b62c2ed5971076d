//! Surfaces that touch: which of them a line or a ray comes to first.
//!
//! Faces that lie in one plane, or a rounding apart, are a stack. Its order belongs to the plane and not to the line:
//! whichever side a line comes from, the faces on the two ends of the stack are the same, and between them all is
//! dark. So a plane has a canonical normal, and faces lie by rising number along it.

use glam::DVec3;
use nestrad_common::geometry;

/// Surfaces that are closer together than this part of the largest coordinate touch. Rounding in f64 moves the place
/// where a line of 0.1 degrees above the horizon meets a plane by a tenth of that.
const TOUCH: f64 = 1.0 / (1u64 << 40) as f64;

/// The canonical normal of a plane is on this side of it. Hardly any plane holds this direction, so a rounding does not
/// turn the normal over.
const CANONICAL: DVec3 = DVec3::new(0.537_767_139, 0.313_033_187, 0.782_811_373);

/// What lies closer together than this touches, metres, in a scene between these corners. It is the same for all parts
/// of a scene.
pub(crate) fn touch_m(min_m: DVec3, max_m: DVec3) -> f64 {
    TOUCH * min_m.abs().max(max_m.abs()).max_element()
}

/// Whether something that moves along a direction comes to the lower of two touching faces first; `lower` is the
/// triangle of the one with the lower number.
pub(crate) fn lower_first(lower: &[DVec3; 3], direction: DVec3) -> bool {
    let normal = geometry::doubled_area_vector(lower);
    (normal.dot(CANONICAL) > 0.0) == (normal.dot(direction) > 0.0)
}
