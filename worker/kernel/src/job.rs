//! What is asked of the kernel: directions of lines, and rays.

use glam::DVec3;

use crate::part::Part;

/// Parallel lines along one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lines {
    /// Unit vector, `z > 0`.
    pub direction: DVec3,
    /// Three numbers in [0, 1): see [`Lattice::new`](crate::lattice::Lattice::new).
    pub random: [f64; 3],
    /// Cross-section of a line, m²: of all directions alike but for their weights.
    pub line_area_m2: f64,
    /// Which part of the lattice's lines is traced.
    pub part: Part,
}

/// Rays from the faces themselves: cosine-distributed, uniform over the element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rays {
    /// Seeds the points and directions, together with batch and face.
    pub seed: u64,
    /// A face expects this many samples in all batches of a half; what its lines fall short of it, rays add.
    pub least_samples: f64,
    /// Batches in a half.
    pub batches_in_half: u32,
    /// Lines of a half that meet a square metre of leaf, on average over its inclination.
    pub lines_per_m2: f64,
    /// What is longer than this is met by several lines of the batch at a time, metres: see [`in_a_row_m`]. A job may
    /// have rays of a batch and none of its lines.
    pub in_a_row_m: f64,
    /// From which part of the faces of the block rays are cast.
    pub part: Part,
}

/// A set of directions that is an estimate of the exchange by itself, or the part of one that a job has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch {
    /// Number of the batch, from 0.
    pub index: u32,
    /// Directions of lines.
    pub lines: Vec<Lines>,
    /// Rays from faces that lines sample too thinly, or from all faces.
    pub rays: Option<Rays>,
}

/// Up to so many lines in a row are as good as lines here and there.
const IN_A_ROW: f64 = 4.0;

/// What is longer than this is met by several lines of a batch at a time, metres; infinite without lines.
pub fn in_a_row_m(lines: &[Lines]) -> f64 {
    match lines.first() {
        Some(lines) => IN_A_ROW * lines.line_area_m2.sqrt(),
        None => f64::INFINITY,
    }
}

impl Rays {
    /// Rays in all batches of a half for a face of that area and that longest edge. What is long is met by many lines
    /// of a lattice at a time, if by any: these are one sample.
    pub fn of_half(&self, area_m2: f64, longest_m: f64) -> u32 {
        let at_a_time = (longest_m / self.in_a_row_m).max(1.0);
        (self.least_samples - area_m2 * self.lines_per_m2 / at_a_time)
            .ceil()
            .max(0.0) as u32
    }
}
