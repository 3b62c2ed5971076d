//! The near-field kernel: for every face of a block, what it sees.
//!
//! A job is self-contained (a block of geometry with all that lies within the sphere's radius of it,
//! and a batch of directions); its result is the rows of the exchange matrix, one end per line or
//! ray, all of equal weight. The same job gives the same rows to the last bit, on any machine and
//! for any number of threads.
//!
//! Plain types only: this crate may import `nestrad-common` and libraries for numbers and threads, but no
//! protobuf, network or command line.

#![allow(
    non_snake_case,
    reason = "units in names are written as units: irradiance_W_m2"
)]

pub mod above;
mod bits;
pub mod block;
pub mod cost;
pub mod directions;
pub mod elements;
pub mod ends;
pub mod expected;
pub mod far_grid;
pub mod ground;
pub mod job;
mod kernel;
pub mod lattice;
mod lines;
mod memory;
pub mod owned;
pub mod packed;
pub mod part;
mod rays;
pub mod rows;
pub mod soil;
mod stacks;
mod touch;
pub mod world;
pub mod zbuffer;

pub use block::{Block, BlockFault};
pub use kernel::kernel;
pub use memory::{BASE_BYTES, Demand};
pub use rays::Tracer;
pub use rows::{PackedRows, Rows, Seen};

use job::Batch;

/// Computes a job of a block; `tracer` is asked for where the job casts rays, and holds the acceleration
/// structure of the block's geometry: build it once per block.
pub fn trace<'a>(block: &Block, tracer: impl FnOnce() -> &'a Tracer, batch: &Batch) -> Seen {
    let mut seen = lines::trace(block, batch);
    if batch.rays.is_some() {
        rays::complete(block, tracer(), batch, &mut seen);
    }
    seen
}

/// What the far field is the mean of, along the lines of a batch: a row for each far end, in their order, then
/// one for each [`Exit`](far_grid::Exit). The block is the whole scene.
pub fn trace_far_field(block: &Block, batch: &Batch) -> Rows {
    rows::of_far_field(block, &lines::beyond_sphere(block, batch))
}
