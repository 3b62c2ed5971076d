//! How densely the exchange is sampled, and the batches of directions that follow from it.

use nestrad_kernel::directions::{Axes, Purpose, axes, stream};
use nestrad_kernel::job::{Batch, Lines, Rays, in_a_row_m};
use nestrad_kernel::lattice::{Extent, Lattice};
use nestrad_kernel::part::Part;
use rand::RngExt;
use serde::Serialize;

/// Batches in a half of the exchange.
pub const HALF_BATCHES: usize = 8;

/// How densely the exchange is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sampling {
    /// Independent batches of directions, an even number; the first half of them carries light one
    /// way, the second half the other way.
    pub batches: u32,
    /// Axes of parallel lines that make a set.
    pub axes: Axes,
    /// Sets of axes in a batch; 0 to use rays only.
    pub sets_per_batch: u32,
    /// Cross-section of a line, m².
    pub line_area_m2: f64,
    /// Samples that every face gets at least, in each half; rays from the face make up for lines.
    pub least_samples: f64,
    /// Start of all random numbers.
    pub seed: u64,
}

const MOST_SETS_AT_A_GLANCE: u32 = 8;
/// From each face in each half, where there are no lines.
const RAYS_AT_A_GLANCE: f64 = 8.0;

impl Sampling {
    /// Lines of a half that meet a square metre of leaf, on average over its inclination: they see
    /// |cos| of its area, whose mean over the hemisphere is 1/2.
    pub fn lines_per_m2(&self) -> f64 {
        let directions = self.batches / 2 * self.sets_per_batch * self.axes.count();
        0.5 * f64::from(directions) / self.line_area_m2
    }

    /// A batch of each half alone, of few sets, without rays for what it meets too thinly: enough to compare two
    /// models by the same lines.
    pub fn glance(&self) -> Self {
        Self {
            batches: 2,
            sets_per_batch: self.sets_per_batch.min(MOST_SETS_AT_A_GLANCE),
            least_samples: if self.sets_per_batch > 0 {
                0.0
            } else {
                RAYS_AT_A_GLANCE
            },
            ..*self
        }
    }

    /// Lines through an extent, in all directions together.
    pub fn lines(&self, extent: &Extent) -> f64 {
        (0..self.batches).map(|b| self.lines_of(b, extent)).sum()
    }

    /// The same of one batch; others have about as many.
    pub fn lines_of(&self, batch: u32, extent: &Extent) -> f64 {
        let lattice = |lines: Lines| {
            Lattice::new(lines.direction, extent, lines.line_area_m2, lines.random).lines()
        };
        let lines = self.batch(batch).lines.into_iter();
        lines.map(|lines| lattice(lines) as f64).sum()
    }

    /// The longest line through a layer of that height, metres; infinite with rays.
    pub fn longest_sight_m(&self, height_m: f64) -> f64 {
        (0..self.batches)
            .flat_map(|b| self.batch(b).lines)
            .map(|lines| height_m / lines.direction.z)
            .fold(
                if self.sets_per_batch == 0 {
                    f64::INFINITY
                } else {
                    0.0
                },
                f64::max,
            )
    }

    /// A batch: its directions and everything random in it.
    pub fn batch(&self, index: u32) -> Batch {
        let numbers = (self.seed, Purpose::Lines, u64::from(index));
        let sets = (self.axes, self.sets_per_batch);
        let lines = lines_along(numbers, sets, self.line_area_m2);
        Batch {
            index,
            rays: Some(Rays {
                seed: self.seed,
                least_samples: self.least_samples,
                batches_in_half: self.batches / 2,
                lines_per_m2: self.lines_per_m2(),
                in_a_row_m: in_a_row_m(&lines),
                part: Part::default(),
            }),
            lines,
        }
    }
}

/// Lines along sets of axes. `numbers` says which random numbers: seed, purpose and index.
pub fn lines_along(
    (seed, purpose, index): (u64, Purpose, u64),
    (kind, sets): (Axes, u32),
    line_area_m2: f64,
) -> Vec<Lines> {
    let mut rng = stream(seed, purpose, index);
    axes(kind, sets, &mut rng)
        .into_iter()
        .map(|axis| Lines {
            direction: axis.direction,
            random: [rng.random(), rng.random(), rng.random()],
            // every line weighs the same: a direction of larger weight has more of them
            line_area_m2: line_area_m2 / axis.weight,
            part: Part::default(),
        })
        .collect()
}
