//! Stems and petioles: tubes of triangles along a curve.

use std::f64::consts::TAU;

use glam::DVec3;

use super::canopy::{Generated, Label};

/// A point of a stem's axis and the radius there, metres.
#[derive(Clone, Copy)]
pub(super) struct Joint {
    pub(super) point: DVec3,
    pub(super) radius_m: f64,
}

/// Adds a tube through two joints or more, with its outside as the upper face. Its base is left open
/// (it stands on the soil or inside another organ), its tip is closed.
pub(super) fn push_tube(canopy: &mut Generated, label: Label, joints: &[Joint], sides: u32) {
    let [first, .., last] = joints else {
        return;
    };
    let mut spoke = (joints[1].point - first.point)
        .normalize()
        .any_orthonormal_vector();
    let mut rings: Vec<Vec<DVec3>> = Vec::with_capacity(joints.len());
    for (i, joint) in joints.iter().enumerate() {
        let before = joints[i.saturating_sub(1)].point;
        let after = joints[(i + 1).min(joints.len() - 1)].point;
        let axis = (after - before).normalize();
        // carrying one spoke along the axis keeps the tube from twisting
        spoke = (spoke - axis * spoke.dot(axis)).normalize();
        let other = axis.cross(spoke);
        let ring = (0..sides).map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(sides)).sin_cos();
            joint.point + joint.radius_m * (cos * spoke + sin * other)
        });
        rings.push(ring.collect());
    }
    for k in 0..sides as usize {
        let next = (k + 1) % sides as usize;
        for pair in rings.windows(2) {
            let (lower, upper) = (&pair[0], &pair[1]);
            canopy.push(label, [lower[k], lower[next], upper[next]]);
            canopy.push(label, [lower[k], upper[next], upper[k]]);
        }
        if let Some(rim) = rings.last() {
            canopy.push(label, [rim[k], rim[next], last.point]);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use glam::DVec2;

    use super::*;
    use crate::canopy::Pattern;

    #[test]
    fn a_tube_is_closed_but_at_its_base_and_faces_outwards() {
        let mut tube = Generated::empty(Pattern {
            min_m: DVec2::ZERO,
            size_m: DVec2::ONE,
        });
        let label = Label {
            species: 1,
            plant: 1,
            leaf: 0,
            element: 1,
        };
        let axis = |z: f64| DVec3::new(0.1 * z * z, -0.2 * z, z);
        let joints: Vec<Joint> = (0..9)
            .map(|i| Joint {
                point: axis(0.1 * f64::from(i)),
                radius_m: 0.02 - 0.002 * f64::from(i),
            })
            .collect();
        push_tube(&mut tube, label, &joints, 7);
        assert_eq!(tube.triangles.len(), 7 * (8 * 2 + 1));

        // every directed edge has its opposite, except those of the base ring
        let key = |v: DVec3| v.to_array().map(f64::to_bits);
        let mut edges = HashMap::new();
        for t in &tube.triangles {
            for i in 0..3 {
                *edges.entry((key(t[i]), key(t[(i + 1) % 3]))).or_insert(0) += 1;
            }
            let centre = (t[0] + t[1] + t[2]) / 3.0;
            let normal = (t[1] - t[0]).cross(t[2] - t[0]);
            if centre.z < 0.75 {
                assert!(normal.dot(centre - axis(centre.z)) > 0.0);
            }
        }
        assert!(edges.values().all(|n| *n == 1));
        let open = edges.keys().filter(|(a, b)| !edges.contains_key(&(*b, *a)));
        assert_eq!(open.count(), 7);
    }
}
