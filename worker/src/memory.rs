//! How much memory a block and a job take, so that both master and worker can tell beforehand.
//!
//! Figures per item are the sizes of the kernel's arrays; the whole is measured by a test with a real
//! process.

use nestrad_proto::v1;

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
    /// What a block says of its sizes, before any memory is taken for them; of its jobs, nothing.
    pub fn of_message(block: &v1::Block) -> Self {
        let mesh = block.mesh.as_ref();
        let triangles = mesh.map_or(0, |mesh| mesh.triangles.max(mesh.vertices.div_ceil(3)));
        let elements = |run: &v1::TriangleRun| {
            let pieces = u64::from(run.divisions).pow(2);
            u64::from(run.triangles).saturating_mul(pieces)
        };
        let world = block.world.unwrap_or_default();
        let soil = world.soil.unwrap_or_default();
        let cells = u64::from(soil.cells_x) * u64::from(soil.cells_y);
        let far = u64::from(world.far_levels) * u64::from(world.far_bins);
        // more cannot be numbered
        let capped = |count: u64| count.min(u64::from(u32::MAX));
        Self {
            triangles: u64::from(triangles),
            elements: capped(block.runs.iter().map(elements).fold(0, u64::saturating_add)),
            other_ends: capped(cells) + 2 * capped(far),
            ..Self::default()
        }
    }

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_of_few_bytes_can_be_a_large_block() {
        let run = v1::TriangleRun {
            triangles: u32::MAX,
            divisions: 100,
            ..v1::TriangleRun::default()
        };
        let mut block = v1::Block {
            mesh: Some(v1::Mesh {
                triangles: 7,
                vertices: 30,
                ..v1::Mesh::default()
            }),
            ..v1::Block::default()
        };
        // ten triangles can have as many vertices
        assert_eq!(Demand::of_message(&block).triangles, 10);
        block.runs = vec![run; 3];
        let demand = Demand::of_message(&block);
        assert_eq!(demand.elements, u64::from(u32::MAX));
        assert!(demand.block_bytes() > 70 << 30);
    }
}
