//! What a ray from a sensor meets.

use glam::DVec3;
use nestrad_common::sensors::{Receives, Sensor};
use nestrad_kernel::Tracer;

use crate::frame::Frame;

/// A sensor that lies in a face, or on the soil, is taken to lie in front of it by this part of the scene's largest
/// coordinate: it sees past the face on both of its sides.
const IN_FRONT: f64 = 1e-8;

/// Rays that begin outside come into a box that is larger than the scene by this part of its largest side: nothing lies
/// where they begin.
const AROUND: f64 = 1e-3;

/// The scene, as sensors see it.
pub(super) struct Eyes<'a> {
    frame: &'a Frame,
    tracer: Tracer,
    in_front_m: f64,
}

impl<'a> Eyes<'a> {
    pub(super) fn new(frame: &'a Frame) -> Self {
        let extent = &frame.world.extent;
        let largest_m = extent.min_m.abs().max(extent.max_m.abs()).max_element();
        Self {
            frame,
            tracer: Tracer::new(frame.block()),
            in_front_m: IN_FRONT * largest_m,
        }
    }

    /// The end that a ray from a point of a sensor meets first, however far away it is.
    pub(super) fn met(&self, sensor: &Sensor, at: DVec3, direction: DVec3) -> u32 {
        let ahead = match sensor.receives {
            Receives::Side { facing, .. } => facing,
            Receives::Everywhere | Receives::From(_) => direction,
        };
        let mut origin = at + self.in_front_m * ahead;
        if let Some(soil) = &self.frame.world.soil {
            // on the soil is above it, for the lower side too
            let lowest = soil.z_m + self.in_front_m;
            if at.z > soil.z_m - self.in_front_m && origin.z < lowest {
                origin.z = lowest;
            }
        }
        let origin = self.nearer(origin, direction);
        self.tracer.met(self.frame.block(), origin, direction)
    }

    pub(super) fn sees_sky(&self, sensor: &Sensor, at: DVec3, direction: DVec3) -> bool {
        self.met(sensor, at, direction) == self.frame.ends.sky()
    }

    /// Where a ray that begins outside comes into the box around all that it can meet: boxes of the tracer are made for
    /// rays that begin inside.
    fn nearer(&self, origin: DVec3, direction: DVec3) -> DVec3 {
        let extent = &self.frame.world.extent;
        let around = DVec3::splat(AROUND * (extent.max_m - extent.min_m).max_element());
        let (low, high) = (extent.min_m - around, extent.max_m + around);
        let (mut enters, mut leaves) = (0.0f64, f64::INFINITY);
        // a pattern has no sides
        let axes = if extent.periodic { 2..3 } else { 0..3 };
        for axis in axes {
            let to = |bound: DVec3| (bound[axis] - origin[axis]) / direction[axis];
            let (a, b) = (to(low), to(high));
            // along a side that it lies in, a ray is in the box: no number is passed over
            (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
        }
        if enters > 0.0 && enters <= leaves && enters.is_finite() {
            origin + enters * direction
        } else {
            origin
        }
    }
}
