//! Whether and where a ray meets a triangle.

use glam::DVec3;

/// Where a ray meets a triangle.
pub(super) struct Meeting {
    /// Distance along the ray.
    pub(super) t: f64,
    /// Barycentric coordinates of the second and third vertex.
    pub(super) b1: f64,
    pub(super) b2: f64,
    /// The ray arrives on the upper face.
    pub(super) upper: bool,
}

/// Watertight ray-triangle test (Woop, Benthin & Wald 2013), in f64: both triangles at an edge
/// evaluate the same products, so a ray through the edge meets at least one of them.
pub(super) struct Edges {
    axes: [usize; 3],
    shear: [f64; 3],
    /// The axes were swapped to keep their handedness.
    flipped: bool,
}

impl Edges {
    pub(super) fn new(direction: DVec3) -> Self {
        let d = direction.to_array();
        let a = direction.abs();
        let kz = if a.x > a.y && a.x > a.z {
            0
        } else if a.y > a.z {
            1
        } else {
            2
        };
        let (kx, ky) = ((kz + 1) % 3, (kz + 2) % 3);
        Self {
            axes: [kx, ky, kz],
            shear: [d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]],
            flipped: d[kz] < 0.0,
        }
    }

    pub(super) fn meet(&self, triangle: &[DVec3; 3], origin: DVec3) -> Option<Meeting> {
        let [kx, ky, kz] = self.axes;
        let [sx, sy, sz] = self.shear;
        let [a, b, c] = triangle.map(|p| {
            let p = (p - origin).to_array();
            [p[kx] - sx * p[kz], p[ky] - sy * p[kz], sz * p[kz]]
        });
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None;
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) / det;
        Some(Meeting {
            t,
            b1: v / det,
            b2: w / det,
            upper: (det > 0.0) != self.flipped,
        })
    }
}
