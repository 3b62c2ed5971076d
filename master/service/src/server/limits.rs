//! What a master takes on.

/// What a master takes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServiceLimits {
    /// Memory of the scenes that are held, bytes.
    pub scene_bytes: u64,
    /// Memory of the results that are held, bytes.
    pub result_bytes: u64,
    /// Memory of the canopies that stay traced, bytes; 0 for none.
    pub resident_bytes: u64,
    /// Memory of one solve, GiB.
    pub solve_GiB: f64,
    /// Solves that are computed at a time; at least 1.
    pub solves: usize,
    /// Solves that may wait.
    pub queue: usize,
    /// Time for running solves to end when the master is told to stop, seconds.
    pub drain_s: u64,
}
