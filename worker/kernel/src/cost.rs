//! What a machine's work costs: the one table that plan, rounds and split read.
//!
//! Times of one core, measured on maize. Plans depend on them, so they are constants and no clocks: the same
//! scene has the same plan on any machine, and only their ratios matter there.

/// To draw a triangle along a direction of the exchange, ns.
pub const DRAWN_NS: f64 = 24.0;

/// To find the two faces that see each other along a segment of a line, to sort and to pack them, ns.
pub const SEGMENT_NS: f64 = 90.0;

/// To use an entry of a row, joining and all passes of the solver together, ns.
pub const USED_NS: f64 = 50.0;

/// To find, pack and use what a line sees on an organ, from both sides, ns.
pub const MET_NS: f64 = SEGMENT_NS + 2.0 * USED_NS;

/// To put a triangle into the frame, and its light into the results, ns.
pub const READ_NS: f64 = 3000.0;

/// To iterate over a row, and to work out its error, without its entries, ns.
pub const SOLVED_NS: f64 = 1000.0;

/// A point of a lattice of the exchange, ns.
pub const LINE_NS: f64 = 9.0;

/// A row of a job, ns.
pub const ROW_NS: f64 = 1.0;

/// To look whether a line of one row of a lattice meets a triangle, ns.
pub const LOOKED_NS: f64 = 12.0;

/// A ray, ns.
pub const RAY_NS: f64 = 1000.0;

/// To build the tree that rays are cast in, per triangle, ns.
pub const TREE_NS: f64 = 1500.0;

/// To draw a triangle into the z-buffer of a direction of a sky, ns.
pub const Z_DRAWN_NS: f64 = 40.0;

/// To deal the light of a direction out to an element, ns.
pub const Z_DEALT_NS: f64 = 60.0;

/// A point of a z-buffer: drawn, compared with its neighbours, dealt out, ns.
pub const Z_POINT_NS: f64 = 75.0;

/// An element, its lines and rows included: 8 000 ns where lines are dense enough for smaller elements anyway,
/// 20 000 and more where they have to be denser.
pub const ELEMENT_NS: f64 = 12_000.0;

/// A soil cell, which has one row, its lines and rays included, ns.
pub const SOIL_CELL_NS: f64 = 0.5 * ELEMENT_NS + 8.0 * RAY_NS;
