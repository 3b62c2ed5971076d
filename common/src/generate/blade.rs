//! Leaf blades: a grid of points over midrib and width, split into triangles.

use glam::DVec3;

use super::canopy::{Generated, Label};

/// A place on the midrib and the axes of the blade there: `along` towards the tip, `across` to the
/// left, both unit vectors at right angles. Their product is the adaxial normal.
#[derive(Clone, Copy)]
pub(super) struct Station {
    pub(super) point: DVec3,
    pub(super) along: DVec3,
    pub(super) across: DVec3,
    /// From the midrib to either edge, metres.
    pub(super) half_width_m: f64,
    /// Both halves are raised by this angle into a V, radians.
    pub(super) fold: f64,
    /// Height of the left and the right edge over the V, metres.
    pub(super) edge_m: [f64; 2],
}

impl Station {
    /// The point at `v` across the blade: -1 is the right edge, 0 the midrib, 1 the left edge.
    fn at(&self, v: f64) -> DVec3 {
        let normal = self.along.cross(self.across);
        let (raised, flat) = self.fold.sin_cos();
        let edge_m = if v > 0.0 {
            self.edge_m[0]
        } else {
            self.edge_m[1]
        };
        let up_m = self.half_width_m * v.abs() * raised + edge_m * v * v;
        self.point + self.half_width_m * v * flat * self.across + up_m * normal
    }
}

/// Numbers of strips along and across (an even number, so that the midrib is an edge) that give
/// triangles of about the area asked for.
pub(super) fn strips(length_m: f64, mean_width_m: f64, triangle_m2: f64) -> (u32, u32) {
    let strip_m = (2.0 * triangle_m2).sqrt();
    let across = 2.0 * (0.5 * mean_width_m / strip_m).round().max(1.0);
    let along = (length_m * mean_width_m / (2.0 * triangle_m2 * across)).round();
    (along.max(3.0) as u32, across as u32)
}

/// Adds the blade through `stations`, from its base to its tip.
pub(super) fn push_blade(canopy: &mut Generated, label: Label, stations: &[Station], across: u32) {
    let row = |station: &Station| -> Vec<DVec3> {
        (0..=across)
            .map(|j| station.at(2.0 * f64::from(j) / f64::from(across) - 1.0))
            .collect()
    };
    let rows: Vec<Vec<DVec3>> = stations.iter().map(row).collect();
    for pair in rows.windows(2) {
        for j in 0..across as usize {
            let (near, far) = (&pair[0], &pair[1]);
            canopy.push(label, [near[j], far[j], far[j + 1]]);
            canopy.push(label, [near[j], far[j + 1], near[j + 1]]);
        }
    }
}
