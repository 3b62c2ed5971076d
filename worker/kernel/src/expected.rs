//! What is known of the rows of a job before it is traced: what any right result keeps to, to the last entry.
//!
//! A line that meets a face goes on from the other face of the same element: the two rows of an element have as many
//! entries from lines as each other. A line that ends on the soil is an entry of its cell, and where it ends follows
//! from the lattice. From which rows rays are cast follows from the geometry. What two rows see of each other along a
//! line, both see: it is one pair. How often lines meet a triangle has a bound: a convex figure of area A and
//! perimeter P holds no more than A + P / 2 + 1 points of a lattice of unit squares (Nosarzewska 1948).
//!
//! Which of two faces a line meets is not known without tracing it: rows that keep to all of this may still be wrong. So
//! a few lines, which nobody can foretell, are traced again: what they see must be there.

use std::ops::Range;
use std::sync::Arc;

use glam::DVec3;
use nestrad_common::geometry;
use thiserror::Error;

use crate::block::Block;
use crate::job::Batch;
use crate::lattice::Lattice;
use crate::lines::{LinesOnSoil, lattices, of_one_row, rows_of};
use crate::owned::Owned;
use crate::packed::{self, PackedFault, Pair, Shape};
use crate::rays;
use crate::rows::Counts;

/// What is known of all jobs of a block.
#[derive(Clone, Debug)]
pub struct OfBlock {
    shape: Shape,
    /// Rows of faces; those of soil cells are behind them.
    face_rows: u32,
    /// Numbers of the ends that have rows in it, rising, and the row of the first of each.
    own_ends: Vec<(Range<u32>, u32)>,
    /// Whether that is all that has rows.
    is_all: bool,
    /// Of all triangles whose rows are wanted.
    triangles: f64,
    area_m2: f64,
    perimeter_m: f64,
}

/// What is known of a job.
#[derive(Clone, Debug)]
pub struct Expected {
    block: Arc<OfBlock>,
    /// As its worker says, as far as they can be.
    counts: Counts,
    /// Entries of rows of soil cells that come from lines.
    on_soil: Vec<u64>,
    /// Rays of each row; empty where none are cast.
    rays_of_row: Vec<u32>,
}

/// Why rows are not those of their job.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum RowsFault {
    /// They cannot be read.
    #[error(transparent)]
    Packed(#[from] PackedFault),
    /// A number is not what it must be.
    #[error("result with {found} {what}, expected {expected}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        found: u64,
        /// How many there must be.
        expected: u64,
    },
    /// There are more than there can be.
    #[error("result with {found} {what}, expected at most {limit}")]
    TooMany {
        /// What is counted.
        what: &'static str,
        /// How many there are.
        found: u64,
        /// How many there can be.
        limit: u64,
    },
    /// Lines that meet faces give two entries each.
    #[error(
        "result with {0} entries, expected two for each face that a line meets, and those of soil and rays"
    )]
    Odd(u64),
    /// Lines that enter an element do not leave it.
    #[error(
        "result with {upper} lines at the upper face of element {element} and {lower} at the lower one"
    )]
    OneSided {
        /// Its number in the block.
        element: u32,
        /// Entries of its upper face that come from lines.
        upper: i64,
        /// Entries of its lower face that come from lines.
        lower: i64,
    },
}

impl OfBlock {
    /// Of the block that holds this much of a scene, whose own block is `scene`.
    pub fn new(scene: &Block, owned: &Owned) -> Self {
        let mut own_ends: Vec<(Range<u32>, u32)> = Vec::new();
        let mut rows = 0;
        let mut own = |ends: Range<u32>| {
            let row = rows;
            rows += ends.end - ends.start;
            match own_ends.last_mut() {
                Some((last, _)) if last.end == ends.start => last.end = ends.end,
                _ => own_ends.push((ends, row)),
            }
        };
        let (mut face_rows, mut triangles) = (0, 0.0);
        let (mut area_m2, mut perimeter_m) = (0.0, 0.0);
        for &(t, _) in owned.triangles.iter().filter(|&&(_, is_owned)| is_owned) {
            let elements = scene.elements.of(t as usize);
            face_rows += 2 * elements.len() as u32;
            own(2 * elements.start..2 * elements.end);
            let corners = scene.soup.triangle(t as usize);
            triangles += 1.0;
            area_m2 += geometry::area(&corners);
            perimeter_m += self::perimeter_m(&corners);
        }
        for &cell in owned.soil_cells {
            let end = scene.ends.soil(cell);
            own(end..end + 1);
        }
        Self {
            shape: Shape {
                rows: face_rows + owned.soil_cells.len() as u32,
                ends: scene.ends.len() as u32,
            },
            face_rows,
            is_all: face_rows + owned.soil_cells.len() as u32 == scene.ends.rows(),
            own_ends,
            triangles,
            area_m2,
            perimeter_m,
        }
    }

    /// Rows of the block, and ends of the world.
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// The row of an end in the block, where it has one.
    #[inline]
    fn row_of(&self, end: u32) -> Option<u32> {
        let behind = self.own_ends.partition_point(|(ends, _)| ends.end <= end);
        let (ends, row) = self.own_ends.get(behind)?;
        (ends.start <= end).then(|| row + (end - ends.start))
    }

    /// What the rows of a job must hold of one row of lines, which `number` chooses: pairs of a row and what it sees,
    /// mutual ones and single ones, in the order in which they are packed. `scene` is the block of the whole scene.
    pub fn look(&self, scene: &Block, batch: &Batch, number: u64) -> Look {
        let mut look = Look::default();
        for (a, b) in of_one_row(scene, batch, number) {
            match (self.row_of(a), self.row_of(b)) {
                (Some(a), Some(b)) => look.mutual.push((a.max(b), a.min(b))),
                (Some(row), None) => look.single.push((row, b)),
                (None, Some(row)) => look.single.push((row, a)),
                (None, None) => {}
            }
        }
        for list in [&mut look.mutual, &mut look.single] {
            list.sort_unstable_by_key(|&(row, seen)| (row, !seen));
        }
        look
    }

    /// What is known of a job of the block, of whose rows a worker says that there are so many. Refused where there
    /// cannot be: before any memory is taken for them.
    pub fn job(
        self: &Arc<Self>,
        scene: &Block,
        owned: &Owned,
        batch: &Batch,
        said: &Counts,
    ) -> Result<Expected, RowsFault> {
        let (mut lines, mut on_soil) = (0, vec![0; owned.soil_cells.len()]);
        let (lattices, parts) = lattices(scene, &batch.lines);
        let parts: Vec<Range<u32>> = lattices
            .iter()
            .zip(parts)
            .map(|(l, p)| rows_of(l, p))
            .collect();
        for (lattice, rows) in lattices.iter().zip(&parts) {
            lines += u64::from(rows.end - rows.start) * u64::from(lattice.nx);
            if let (Some(soil), Some(ground)) = (&scene.soil, scene.ground) {
                let under = LinesOnSoil::new(soil, ground, lattice, rows.clone());
                for (count, &cell) in on_soil.iter_mut().zip(owned.soil_cells) {
                    *count += under.of(cell);
                }
            }
        }
        same("lines", said.lines, lines)?;
        let (mut rays, mut rays_of_row) = (0, Vec::new());
        if batch.rays.is_some() {
            rays_of_row = vec![0; self.shape.rows as usize];
            rays::count_of_rows(scene, owned, batch, |row, count| {
                rays += u64::from(count);
                rays_of_row[row as usize] = count;
            });
        }
        same("rays", said.rays, rays)?;
        let of_hits = said
            .row_entries
            .checked_sub(on_soil.iter().sum::<u64>() + rays)
            .filter(|entries| entries % 2 == 0);
        let hits = of_hits.ok_or(RowsFault::Odd(said.row_entries))? / 2;
        let most = |hits: &dyn Fn(&Lattice, &Range<u32>) -> f64| {
            let all = lattices.iter().zip(&parts);
            // corners are rounded to a millionth of a step
            (1.001 * all.map(|(lattice, rows)| hits(lattice, rows)).sum::<f64>()) as u64
        };
        // rows that are met more than others by far are looked at more closely
        if hits > most(&|lattice, rows| self.many_hits(lattice, rows)) {
            let limit = most(&|lattice, rows| self.most_hits(scene, owned, lattice, rows));
            if hits > limit {
                return Err(RowsFault::TooMany {
                    what: "faces that lines meet",
                    found: hits,
                    limit,
                });
            }
        }
        Ok(Expected {
            block: self.clone(),
            counts: *said,
            on_soil,
            rays_of_row,
        })
    }

    /// How often lines of a lattice meet the block's own triangles, at most.
    fn hits(&self, lattice: &Lattice) -> f64 {
        self.area_m2 / lattice.line_area_m2
            + 0.5 * lattice.most_steps_per_m() * self.perimeter_m
            + self.triangles
    }

    /// More than what the lines of some rows meet, where triangles are not all in a few of them.
    fn many_hits(&self, lattice: &Lattice, rows: &Range<u32>) -> f64 {
        const MANY: f64 = 4.0;
        let share = f64::from(rows.end - rows.start) / f64::from(lattice.ny);
        self.hits(lattice) * (MANY * share).min(1.0)
    }

    /// How often the lines of some rows of a lattice meet the block's own triangles, at most.
    fn most_hits(&self, scene: &Block, owned: &Owned, lattice: &Lattice, rows: &Range<u32>) -> f64 {
        let own = owned.triangles.iter().filter(|&&(_, is_owned)| is_owned);
        own.map(|&(t, _)| {
            let corners = scene.soup.triangle(t as usize);
            if lattice.may_meet(rows, &corners) {
                let steps = perimeter_m(&corners) * lattice.most_steps_per_m();
                geometry::area(&corners) / lattice.line_area_m2 + 0.5 * steps + 1.0
            } else {
                0.0
            }
        })
        .sum()
    }
}

/// What a few lines of a job see.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Look {
    mutual: Vec<Pair>,
    single: Vec<Pair>,
}

impl Look {
    /// Whether packed rows, which can be read, hold all of it.
    pub fn is_in(&self, packed: &[u8], shape: Shape) -> bool {
        let (mut mutual, mut single) =
            (self.mutual.iter().peekable(), self.single.iter().peekable());
        let read = packed::for_each_pair(packed, shape, |row, end, is_mutual| {
            let left = if is_mutual { &mut mutual } else { &mut single };
            left.next_if_eq(&&(row, end));
        });
        read.is_ok() && mutual.next().is_none() && single.next().is_none()
    }
}

impl Expected {
    /// Checks packed rows, entry by entry.
    pub fn check(&self, packed: &[u8]) -> Result<(), RowsFault> {
        let OfBlock {
            shape, face_rows, ..
        } = *self.block.as_ref();
        let mut lengths = vec![0u32; shape.rows as usize];
        let (mut entries, mut mutual, mut single, mut one_way) = (0u64, 0u64, 0u64, 0u64);
        packed::for_each_pair(packed, shape, |row, end, is_mutual| {
            lengths[row as usize] += 1;
            entries += 1;
            if is_mutual {
                lengths[end as usize] += 1;
                entries += 1;
                mutual += 1;
            } else {
                single += 1;
                one_way += u64::from(self.block.row_of(end).is_some());
            }
        })?;
        let Counts {
            segments,
            rays,
            row_entries,
            lines,
        } = self.counts;
        same("entries", entries, row_entries)?;
        // what both see along a line is one pair: only rays look one way
        at_most("looks that are not returned", one_way, rays)?;
        // beside those of the rows: what lines without a face or soil, and those that others own, are seen by
        let own = mutual + single.saturating_sub(rays);
        if segments < own {
            return Err(RowsFault::Count {
                what: "segments",
                found: segments,
                expected: own,
            });
        }
        if self.block.is_all {
            at_most("segments", segments, own + lines)?;
        }
        let rays_of = |row: usize| self.rays_of_row.get(row).copied().unwrap_or(0);
        let from_lines = |row: usize| i64::from(lengths[row]) - i64::from(rays_of(row));
        for element in 0..face_rows / 2 {
            let [upper, lower] = [0, 1].map(|side| from_lines(2 * element as usize + side));
            if upper != lower || upper < 0 {
                return Err(RowsFault::OneSided {
                    element,
                    upper,
                    lower,
                });
            }
        }
        for (k, &lines) in self.on_soil.iter().enumerate() {
            let found = from_lines(face_rows as usize + k).max(0) as u64;
            same("lines that end on a soil cell", found, lines)?;
        }
        Ok(())
    }
}

fn perimeter_m(corners: &[DVec3; 3]) -> f64 {
    let edge_m = |k: usize| corners[k].distance(corners[(k + 1) % 3]);
    edge_m(0) + edge_m(1) + edge_m(2)
}

fn same(what: &'static str, found: u64, expected: u64) -> Result<(), RowsFault> {
    if found == expected {
        return Ok(());
    }
    Err(RowsFault::Count {
        what,
        found,
        expected,
    })
}

fn at_most(what: &'static str, found: u64, limit: u64) -> Result<(), RowsFault> {
    if found <= limit {
        return Ok(());
    }
    Err(RowsFault::TooMany { what, found, limit })
}
