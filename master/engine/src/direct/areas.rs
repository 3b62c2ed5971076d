//! Areas of triangles and organs, which every source sees from another side.

use glam::DVec3;
use nestrad_common::geometry;

use crate::frame::Frame;

/// Areas that all sources share.
pub(super) struct Areas {
    /// Normal to the upper face of each triangle, as long as its area, m².
    triangle_m2: Vec<DVec3>,
    /// Of each organ, m².
    pub(super) organ_m2: Vec<f64>,
    /// Lower and upper corner of the box around each organ, metres.
    pub(super) organ_boxes_m: Vec<[DVec3; 2]>,
}

impl Areas {
    pub(super) fn of(frame: &Frame) -> Self {
        let vector = |triangle| 0.5 * geometry::doubled_area_vector(&triangle);
        let triangle_m2: Vec<DVec3> = frame.soup().triangles().map(vector).collect();
        let mut organ_m2 = vec![0.0; frame.organs];
        for (&organ, area) in frame.organ.iter().zip(&triangle_m2) {
            organ_m2[organ as usize] += area.length();
        }
        let mut organ_boxes_m = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; frame.organs];
        for (&organ, corners) in frame.organ.iter().zip(frame.soup().triangles()) {
            let [lo, hi] = &mut organ_boxes_m[organ as usize];
            for corner in corners {
                (*lo, *hi) = (lo.min(corner), hi.max(corner));
            }
        }
        Self {
            triangle_m2,
            organ_m2,
            organ_boxes_m,
        }
    }

    /// Area of each organ, perpendicular to a source, m².
    pub(super) fn projected_organs_m2(&self, frame: &Frame, towards: DVec3) -> Vec<f64> {
        let mut organs = vec![0.0; self.organ_m2.len()];
        for (&organ, area) in frame.organ.iter().zip(&self.triangle_m2) {
            organs[organ as usize] += area.dot(towards).abs();
        }
        organs
    }

    /// Projected area of an element, m²; negative when the lower face looks towards the source.
    pub(super) fn projected_m2(&self, frame: &Frame, element: usize, towards: DVec3) -> f64 {
        let t = frame.triangle_of_element[element] as usize;
        let n = frame.elements().divisions[t];
        self.triangle_m2[t].dot(towards) / f64::from(n * n)
    }
}
