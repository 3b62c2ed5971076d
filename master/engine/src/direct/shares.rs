//! What is uncertain of how uncollided light is shared out between plants, structures and soil.

use nestrad_common::optics::Band;

use super::classes::Face;
use super::outlines::{self, Outline};
use crate::frame::Frame;
use crate::sinks::{SINKS, Sink};

/// Variances of uncollided light in a band, W².
#[derive(Clone, Debug)]
pub struct ShareVariances {
    /// Of what sinks absorb.
    pub(crate) sinks_W2: [f64; SINKS],
    /// Of what each material absorbs.
    pub(crate) material_W2: Vec<f64>,
    /// Of what is scattered.
    pub(crate) scattered_W2: f64,
    /// Of what does not pass all surfaces by.
    pub(crate) caught_W2: f64,
}

impl ShareVariances {
    /// Of so many materials, without light.
    pub(super) fn dark(materials: usize) -> Self {
        Self {
            sinks_W2: [0.0; SINKS],
            material_W2: vec![0.0; materials],
            scattered_W2: 0.0,
            caught_W2: 0.0,
        }
    }

    /// Adds those of a direction, whose points bring this power each.
    pub(super) fn add_direction(
        &mut self,
        frame: &Frame,
        band: &Band,
        scene: &[Outline],
        point_W: f64,
    ) {
        let point_W2 = point_W * point_W;
        let absorptance = |face: Face| match face {
            Face::Leaf { material, upper } => band.materials[material as usize].absorptance(upper),
            Face::Soil => 1.0 - band.soil_albedo,
        };
        let sinks_of = |face: Face| match face {
            Face::Leaf { material, .. } => Sink::of(frame.kinds[material as usize]),
            Face::Soil => &[Sink::Soil],
        };
        for (k, sum) in self.sinks_W2.iter_mut().enumerate() {
            let worth = |face: Face| {
                let counts = sinks_of(face).iter().any(|&sink| sink as usize == k);
                if counts { absorptance(face) } else { 0.0 }
            };
            *sum += point_W2 * outlines::variance(scene, worth);
        }
        for (m, sum) in self.material_W2.iter_mut().enumerate() {
            let worth = |face: Face| match face {
                Face::Leaf { material, .. } if material as usize == m => absorptance(face),
                _ => 0.0,
            };
            *sum += point_W2 * outlines::variance(scene, worth);
        }
        let scattered = outlines::variance(scene, |face| 1.0 - absorptance(face));
        let caught = outlines::variance(scene, |face| if face == Face::Soil { 0.0 } else { 1.0 });
        self.scattered_W2 += point_W2 * scattered;
        self.caught_W2 += point_W2 * caught;
    }

    pub(super) fn add(&mut self, other: &Self) {
        let add = |to: &mut [f64], from: &[f64]| {
            to.iter_mut().zip(from).for_each(|(a, b)| *a += b);
        };
        add(&mut self.sinks_W2, &other.sinks_W2);
        add(&mut self.material_W2, &other.material_W2);
        self.scattered_W2 += other.scattered_W2;
        self.caught_W2 += other.caught_W2;
    }
}
