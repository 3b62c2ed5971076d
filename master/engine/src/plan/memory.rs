//! How much memory a plan takes: what is alive at the same time in each stage of a solve, of which the largest counts.
//!
//! Figures per item are the sizes of the arrays that hold them. They depend on the scene and on the plan alone, not on
//! the number of threads or workers: where memory is short, what is planned by them is the same for any number. The
//! whole is measured with real processes (`master/docs/memory.md`).

use serde::Serialize;

use super::{Entries, Plan, WorkCounts};
use crate::exchange::HALF_BATCHES;
use crate::lit_canopy::LitCanopy;

/// Memory of a solve at the stage at which it is largest, GiB.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Memory {
    /// The program, its threads, and what the allocator keeps.
    pub program_GiB: f64,
    /// Triangles, elements and their results.
    pub scene_GiB: f64,
    /// Rows of the exchange.
    pub rows_GiB: f64,
    /// Direct light, irradiances, radiosities and error estimates.
    pub solver_GiB: f64,
}

impl Memory {
    /// Of a plan for a lit canopy.
    pub fn of(lit: &LitCanopy, plan: &Plan) -> Self {
        let sizes = Sizes::of(lit, plan);
        let stages = [
            sizes.direct_light(),
            sizes.tracing(),
            sizes.solving(),
            sizes.results(),
        ];
        let larger = |a: Self, b: Self| if b.total_GiB() > a.total_GiB() { b } else { a };
        stages.into_iter().fold(stages[0], larger)
    }

    /// The same where direct light is computed while rows come from elsewhere.
    pub(super) fn of_at_once(lit: &LitCanopy, plan: &Plan) -> Self {
        let sizes = Sizes::of(lit, plan);
        let (direct, tracing) = (sizes.direct_light(), sizes.tracing());
        Self {
            solver_GiB: direct.solver_GiB,
            ..tracing
        }
    }

    /// All of it.
    pub fn total_GiB(&self) -> f64 {
        self.program_GiB + self.scene_GiB + self.rows_GiB + self.solver_GiB
    }
}

/// What a process takes before it has read anything, with the tables of results that are on their way to the disk.
const PROGRAM_BYTES: f64 = (24 << 20) as f64;

/// What the allocator keeps of what was freed, in parts of what is in use.
const KEPT: f64 = 0.03;

/// Groups that the sources of a sky, and the others, are worked off in: see [`crate::direct`].
const GROUPS: f64 = crate::direct::GROUPS as f64;

/// The numbers that memory goes by.
struct Sizes {
    triangles: f64,
    elements: f64,
    rows: f64,
    organs: f64,
    bands: f64,
    /// Bands that are solved for, and how many of them lie side by side at a time.
    scattering: f64,
    lanes: f64,
    /// Groups of sources.
    groups: f64,
    /// Bytes of the canopy as it was read.
    canopy_bytes: f64,
    exchange: Option<Entries>,
}

impl Sizes {
    fn of(lit: &LitCanopy, plan: &Plan) -> Self {
        let counts = WorkCounts::without_entries(lit, plan);
        let scattering = plan.light.scattering_bands.len();
        let (sky, all) = (lit.sources.sky_directions, lit.sources.list.len());
        Self {
            triangles: counts.triangles,
            elements: counts.elements,
            rows: counts.rows,
            organs: lit.canopy.organs.len() as f64,
            bands: lit.optics.len() as f64,
            scattering: scattering as f64,
            lanes: match scattering {
                0..=2 => scattering as f64,
                3..=4 => 4.0,
                _ => 8.0,
            },
            groups: (sky as f64).min(GROUPS) + ((all - sky) as f64).min(GROUPS),
            canopy_bytes: lit.canopy.bytes() as f64,
            exchange: plan.trace.sampling.map(|_| plan.entries(lit)),
        }
    }

    /// What there is all the time: the canopy, its names, its frame, and the results of an earlier round.
    fn scene_bytes(&self) -> f64 {
        let frame = 72.0 + 24.0 + 8.0;
        self.canopy_bytes
            + self.triangles * (frame + self.solution_bytes())
            + self.elements * (12.0 + 2.0)
            + self.organs * (300.0 + self.solution_bytes())
    }

    /// Results of a triangle or an organ.
    fn solution_bytes(&self) -> f64 {
        40.0 * self.bands + 8.0
    }

    /// The direct light as it is kept.
    fn direct_bytes(&self) -> f64 {
        8.0 * self.bands * (self.rows + self.elements + 2.0 * self.organs)
    }

    /// Every group of sources has light and counters of its own.
    fn direct_light(&self) -> Memory {
        let counters = 4.0 * (self.rows + self.elements) + 40.0 * self.elements + 16.0 * self.rows;
        let of_group = self.direct_bytes() + counters + 1500.0 * self.organs + (2 << 20) as f64;
        self.at([0.0, self.direct_bytes() + self.groups * of_group])
    }

    /// All batches but one, and that one as it is sorted; or the last batches on their way into their half.
    fn tracing(&self) -> Memory {
        let Some(entries) = &self.exchange else {
            return self.at([0.0, self.direct_bytes()]);
        };
        let starts = 4.0 * (entries.batches + 2.0) * self.rows;
        let last = entries.all() / entries.batches;
        let sorted = SORTED_BYTES * last.max(0.25 * entries.of_looks);
        let joined = JOINED * 4.0 * entries.all() + JOINED_BYTES * self.rows;
        let tree = TREE_BYTES * self.triangles;
        let main = 4.0 * (entries.all() - last) + (sorted + tree).max(joined);
        self.at([
            self.looks_bytes(entries) + main + starts,
            self.direct_bytes(),
        ])
    }

    fn solving(&self) -> Memory {
        let Some(entries) = &self.exchange else {
            return self.at([0.0, self.direct_bytes()]);
        };
        let row = HALF_ROW_BYTES * 2.0 + OUTLOOK_BYTES;
        let rows = self.looks_bytes(entries) + 4.0 * entries.all() + row * self.rows;
        let lanes = 8.0 * self.lanes;
        let kept = 16.0 * self.scattering;
        let passes = FIELDS * lanes + 8.0;
        let spread = 64.0 * PULLS + 32.0 + if self.lanes > 2.0 { 2.0 * lanes } else { 0.0 };
        let groups = 4.0;
        let solver = (kept + groups + passes.max(spread)) * self.rows
            + 8.0 * self.scattering * (self.triangles + self.organs)
            + 8.0 * self.elements;
        self.at([rows, self.direct_bytes() + solver])
    }

    /// In the order of the frame, and in that of the canopy.
    fn results(&self) -> Memory {
        let own = self.solution_bytes() * (self.triangles + self.organs);
        let irradiances = 16.0 * self.scattering * self.rows;
        self.at([0.0, self.direct_bytes() + irradiances + 2.0 * own])
    }

    /// Two exchanges of few lines, with what is made of them.
    fn looks_bytes(&self, entries: &Entries) -> f64 {
        if entries.of_looks == 0.0 {
            return 0.0;
        }
        let row = HALF_ROW_BYTES * 2.0 / HALF_BATCHES as f64 + 16.0 + OUTLOOK_BYTES;
        4.0 * entries.of_looks + 2.0 * row * self.rows
    }

    /// Memory with so much for rows and for the solver, bytes.
    fn at(&self, [rows, solver]: [f64; 2]) -> Memory {
        let scene = self.scene_bytes();
        Memory {
            program_GiB: (PROGRAM_BYTES + KEPT * (scene + rows + solver)) / GIB,
            scene_GiB: scene / GIB,
            rows_GiB: rows / GIB,
            solver_GiB: solver / GIB,
        }
    }
}

const GIB: f64 = (1u64 << 30) as f64;

/// While a batch is sorted, for each of its entries: pairs, runs of rows, and the hits of lines that are drawn at the
/// same time.
const SORTED_BYTES: f64 = 16.0;

/// What is there twice while batches are joined: parts of pages, in parts of all.
const JOINED: f64 = 0.03;

/// What a joined half takes for each row, besides its entries: its start, and where its batches end.
const HALF_ROW_BYTES: f64 = 8.0 + 2.0 * HALF_BATCHES as f64;

/// The first half, and what the second is joined with.
const JOINED_BYTES: f64 = 2.0 * HALF_ROW_BYTES;

/// The tree that rays are cast in, per triangle.
const TREE_BYTES: f64 = 140.0;

/// What rows see of the sky and so on.
const OUTLOOK_BYTES: f64 = 56.0;

/// Numbers of each band and row while the solver iterates: two halves of two fields each, the direct light, the
/// iterate, its residual, four directions of two fields each.
const FIELDS: f64 = 16.0;

/// Lines of pulls for each row, while errors are worked out.
const PULLS: f64 = 5.0;
