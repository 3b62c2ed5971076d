//! How much memory a block and a job take, so that both master and worker can tell beforehand.
//!
//! Figures per item are the sizes of the kernel's arrays; the whole is measured by a test with a real
//! process.

/// What a process takes before it holds anything: program, threads, network buffers.
pub const BASE_BYTES: u64 = 48 << 20;

/// Sizes of a block, and of the largest job over it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Demand {
    /// Triangles of the block.
    pub triangles: u64,
    /// Elements of the block.
    pub elements: u64,
    /// Ends of the world that are not faces.
    pub other_ends: u64,
    /// Rows of the block.
    pub rows: u64,
    /// Entries that a job gives, about.
    pub entries: u64,
}

impl Demand {
    /// Bytes that stay taken while a worker holds the block.
    pub fn block_bytes(&self) -> u64 {
        // vertices twice, the tree and its copies; numbers and flags of elements
        210 * self.triangles + 18 * self.elements + 8 * self.other_ends
    }

    /// Bytes that are taken besides while the block is made ready: the message, then the tree's making.
    pub fn making_bytes(&self) -> u64 {
        260 * self.triangles
    }

    /// Bytes of a job at work.
    pub fn job_bytes(&self) -> u64 {
        // counts of rows; pairs, rows and packed rows; lists of triangles by strip
        8 * self.rows + 16 * self.entries + 32 * self.triangles
    }

    /// Bytes that a worker needs that computes `threads` such jobs at a time, and holds `blocks` such
    /// blocks.
    pub fn worker_bytes(&self, threads: u32, blocks: u64) -> u64 {
        let jobs = u64::from(threads) * self.job_bytes();
        BASE_BYTES + blocks * self.block_bytes() + self.making_bytes().max(jobs)
    }

    /// The larger of two demands, number by number.
    #[must_use]
    pub fn max(&self, other: &Self) -> Self {
        Self {
            triangles: self.triangles.max(other.triangles),
            elements: self.elements.max(other.elements),
            other_ends: self.other_ends.max(other.other_ends),
            rows: self.rows.max(other.rows),
            entries: self.entries.max(other.entries),
        }
    }
}
