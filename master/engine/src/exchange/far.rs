//! What the far field is the mean of: lines through the whole scene.
//!
//! What comes from a far end is the mean of what stands at the other end of the lines of sight that pass there
//! out of the sphere, faces whose radiosities are being solved for. So each far end is a row of its own, next to
//! the rows of the faces, and its radiosity (pi times the radiance) is the plain mean over its entries.

use nestrad_kernel::directions::{Axes, Purpose};
use nestrad_kernel::far_grid::Exit;
use nestrad_kernel::job::Batch;
use nestrad_kernel::trace_far_field;

use super::ExchangeError;
use super::rows::{BatchRows, HalfRows};
use super::sampling::{HALF_BATCHES, lines_along};
use crate::frame::Frame;
use crate::stop::Stop;

/// How densely the far field's lines stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct FarSampling {
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
    /// A row for each far end, then one for each exit.
    pub halves: [HalfRows; 2],
    far_ends: u32,
}

impl FarRows {
    /// Draws lines through the whole scene.
    pub fn trace(
        frame: &Frame,
        sampling: &FarSampling,
        stop: &Stop,
    ) -> Result<Self, ExchangeError> {
        let extent = &frame.world.extent;
        let size = extent.max_m - extent.min_m;
        let directions = HALF_BATCHES as u32 * sampling.sets_per_batch * Axes::Both.count();
        // lines are counted on the ground; a direction has |cos| of them, 1/2 on average
        let line_area_m2 =
            0.5 * size.x * size.y * f64::from(directions) / f64::from(sampling.lines);
        let batch = |index: usize| {
            stop.check()?;
            let numbers = (sampling.seed, Purpose::FarField, index as u64);
            let sets = (Axes::Both, sampling.sets_per_batch);
            let batch = Batch {
                lines: lines_along(numbers, sets, line_area_m2),
                ..Batch::default()
            };
            let seen = trace_far_field(frame.block(), &batch);
            Ok::<_, ExchangeError>(BatchRows::new(&seen.lengths, seen.ends))
        };
        let half = |h: usize| {
            let batches = h * HALF_BATCHES..(h + 1) * HALF_BATCHES;
            let batches: Vec<BatchRows> = batches.map(batch).collect::<Result<_, _>>()?;
            Ok::<_, ExchangeError>(HalfRows::join(batches))
        };
        Ok(Self {
            halves: [half(0)?, half(1)?],
            far_ends: frame.ends.far_ends,
        })
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        self.halves.iter().map(HalfRows::bytes).sum()
    }

    /// The row of what leaves the scene that way.
    pub fn leaving(&self, exit: Exit) -> usize {
        exit.row(self.far_ends) as usize
    }
}
