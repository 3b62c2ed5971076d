//! The near-field kernel: for every face of a block, what it sees.
//!
//! A job is self-contained (a block of geometry with all that lies within the sphere's radius of it,
//! and a batch of directions); its result is the rows of the exchange matrix, one end per line or
//! ray, all of equal weight. The same job gives the same rows to the last bit, on any machine and
//! for any number of threads.

mod block;
mod kernel;
mod lines;
mod memory;
mod part;
mod rays;
mod rows;
pub mod serving;

pub use block::{Block, BlockFault};
pub use kernel::kernel;
pub use memory::{BASE_BYTES, Demand};
pub use rays::Tracer;

use nestrad_proto::v1;

/// Computes one batch of a block.
///
/// `tracer` holds the acceleration structure of the block's geometry; build it once per block.
pub fn trace(block: &Block, tracer: &Tracer, batch: &v1::Batch) -> v1::Rows {
    let mut traced = lines::trace(block, batch);
    rays::complete(block, tracer, batch, &mut traced);
    rows::collect(block, &traced)
}

/// The rows of a job, as they travel and are kept.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PackedRows {
    /// See `RowsHeader` in the protocol.
    pub packed: Vec<u8>,
    /// Rows of the block, empty ones included.
    pub rows: u32,
    /// Entries of all rows.
    pub entries: u64,
    /// Lines that were traced.
    pub lines: u64,
    /// Segments between hits that they gave.
    pub segments: u64,
    /// Rays that were cast.
    pub rays: u64,
}

/// Computes a job of a block; `tracer` is asked for where the job casts rays.
pub fn trace_packed<'a>(
    block: &Block,
    tracer: impl FnOnce() -> &'a Tracer,
    batch: &v1::Batch,
) -> PackedRows {
    let mut traced = lines::trace(block, batch);
    if batch.rays.is_some() {
        rays::complete(block, tracer(), batch, &mut traced);
    }
    let (packed, entries) = rows::pack(block, &traced);
    PackedRows {
        packed,
        rows: block.rows() as u32,
        entries,
        lines: traced.lines,
        segments: traced.segments(),
        rays: traced.rays,
    }
}

/// What the far field is the mean of, along the lines of a batch: a row for each far end, in their order,
/// then one for what leaves upwards and one for what leaves downwards. The block is the whole scene.
pub fn trace_far_field(block: &Block, batch: &v1::Batch) -> v1::Rows {
    rows::of_far_field(block, &lines::beyond_sphere(block, batch))
}
