//! The far field closed on the solution: what comes from a level and bin is the mean of what stands at the
//! other end of the lines of sight that pass there out of the sphere, faces whose radiosities are being
//! solved for.
//!
//! So each level and bin is a row of its own, next to the rows of the faces, and its radiosity
//! (pi times the radiance) is the plain mean over its entries. The layer model gives the start.

use std::num::NonZeroUsize;

use nestrad_common::directions::{Axes, Purpose};
use nestrad_common::problem::Problem;
use nestrad_worker::BlockFault;
use serde::Serialize;

use super::layers::Layers;
use super::transport;
use crate::exchange::{BatchRows, BlockOf, HalfRows, batch_of_lines, block_here};
use crate::solver::HALF_BATCHES;
use crate::world::World;

/// How finely the far field is resolved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Resolution {
    /// Levels, evenly spaced from the bottom to the top of the scene; at least 2.
    pub levels: u32,
    /// Bins per hemisphere, uniform in the cosine of the zenith angle.
    pub bins: u32,
    /// Sets of axes along which lines are drawn, in each of the batches of a half.
    pub sets_per_batch: u32,
    /// Lines of a half, about.
    pub lines: u32,
    /// Start of all random numbers.
    pub seed: u64,
}

/// What the far field is the mean of, from two independent halves of lines, each in independent batches.
#[derive(Clone, Debug, Default)]
pub struct FarRows {
    /// A row for each far end, then one for all that leaves upwards and one for all that leaves downwards.
    pub halves: [HalfRows; 2],
}

impl FarRows {
    /// Draws lines through the whole scene.
    pub fn trace(
        problem: &Problem,
        world: &World,
        resolution: &Resolution,
    ) -> Result<Self, BlockFault> {
        let block = block_here(&problem.scene, world, &BlockOf::whole(world))?;
        let size = world.extent.max_m - world.extent.min_m;
        let directions = HALF_BATCHES as u32 * resolution.sets_per_batch * Axes::Both.count();
        // lines are counted on the ground; a direction has |cos| of them, 1/2 on average
        let line_area_m2 =
            0.5 * size.x * size.y * f64::from(directions) / f64::from(resolution.lines);
        let batch = |index: usize| {
            let lines = batch_of_lines(
                (resolution.seed, Purpose::FarField, index as u64),
                (Axes::Both, resolution.sets_per_batch),
                line_area_m2,
            );
            let seen = nestrad_worker::trace_far_field(&block, &lines);
            BatchRows::new(&seen.lengths, seen.ends)
        };
        let half = |h: usize| {
            let batches: Vec<BatchRows> = (h * HALF_BATCHES..(h + 1) * HALF_BATCHES)
                .map(batch)
                .collect();
            HalfRows::join(&batches)
        };
        Ok(Self {
            halves: [half(0), half(1)],
        })
    }
}

/// Radiosities (pi times radiance) of the far ends by the layer model, W m⁻², indexed
/// `far end * bands + band`.
pub fn from_layers(problem: &Problem, world: &World, resolution: &Resolution) -> Vec<f64> {
    let (ends, bands) = (&world.ends, problem.bands.len());
    let mut start = vec![0.0; ends.far_len() as usize * bands];
    let one = NonZeroUsize::MIN;
    let count = |n: u32| NonZeroUsize::new(n as usize).unwrap_or(one);
    let classes = count(INCLINATION_CLASSES);
    // without ground under it a scene has no layers, and the field starts from nothing
    let Ok(layers) = Layers::from_scene(&problem.scene, count(resolution.levels - 1), classes)
    else {
        return start;
    };
    for (b, band) in problem.bands.iter().enumerate() {
        let soil = problem.scene.soil_z_m.map(|_| band.soil_albedo);
        let field = transport::solve(
            &layers,
            band,
            b,
            &problem.sources,
            soil,
            count(resolution.bins),
        );
        for bin in 0..ends.far_bins {
            for level in 0..ends.far_levels.min(field.levels() as u32) {
                let (l, m) = (level as usize, bin as usize);
                let mut set = |end: u32, radiance: f64| {
                    start[(end - ends.far_start()) as usize * bands + b] =
                        std::f64::consts::PI * radiance;
                };
                set(ends.far_from_above(bin, level), field.radiance_down(l, m));
                set(ends.far_from_below(bin, level), field.radiance_up(l, m));
            }
        }
    }
    start
}

/// Classes of leaf inclination in the layers: against 900 they change the albedo by less than 2e-5.
const INCLINATION_CLASSES: u32 = 18;
