//! What a master gives back.

use nestrad_engine::solution::Solution;
use nestrad_engine::stopwatch::{Stage, Usage};
use nestrad_engine::traced::WorkDone;

/// A solution from a master, and the master's own account of how it came to it.
#[derive(Clone, Debug)]
pub struct SolvedThere {
    /// The results.
    pub solution: Solution,
    /// The plan, as `plan` in `summary.json`.
    pub plan: serde_json::Value,
    /// How much was computed.
    pub work: WorkDone,
    /// The cost of each stage at the master.
    pub stages: Vec<Stage>,
    /// Of the whole, at the master.
    pub usage: Usage,
}
