//! Packed rows of the jobs of a batch, joined into the rows of the scene.
//!
//! Jobs are read at the same time, and their entries laid out by runs of rows; then runs are sorted at the same
//! time. In which order entries come to a row is a matter of chance; sorted, they are what they are.

use std::ops::Range;

use nestrad_proto::packed::{self, PackedFault, Shape};
use rayon::prelude::*;

use super::assembly::JobRows;
use super::jobs::BlockOf;
use super::rows::BatchRows;
use crate::world::World;

/// Rows that are sorted together: their counters fit a first-level cache.
const SORTED_TOGETHER: usize = 1 << 13;

/// Entries that are laid out at a time, 8 bytes each; where there are more, jobs are read again.
const MOST_AT_ONCE: u64 = 1 << 26;

/// Joins the jobs of all blocks of a batch.
pub(super) fn join(
    world: &World,
    parts: &[(&BlockOf, Vec<JobRows>)],
) -> Result<BatchRows, PackedFault> {
    let runs = world.rows().div_ceil(SORTED_TOGETHER);
    let rows_of: Vec<Vec<u32>> = parts
        .par_iter()
        .map(|(block, _)| block.rows(world))
        .collect();
    let jobs: Vec<Job> = parts
        .iter()
        .zip(&rows_of)
        .flat_map(|((_, jobs), rows)| {
            jobs.iter().map(|job| Job {
                packed: &job.packed,
                rows,
                ends: world.ends.len() as u32,
                of_a_run: job.traced.row_entries as usize / runs.max(1),
            })
        })
        .collect();
    let results = parts.iter().flat_map(|(_, jobs)| jobs);
    let entries: u64 = results.map(|job| job.traced.row_entries).sum();
    let at_once = runs.div_ceil(entries.div_ceil(MOST_AT_ONCE).max(1) as usize);
    let (mut lengths, mut ends) = (Vec::with_capacity(world.rows()), Vec::new());
    ends.reserve_exact(entries as usize);
    for first in (0..runs).step_by(at_once.max(1)) {
        let part = first..(first + at_once).min(runs);
        let laid_out: Result<Vec<Vec<Vec<u64>>>, PackedFault> =
            jobs.par_iter().map(|job| job.lay_out(&part)).collect();
        let laid_out = laid_out?;
        let sorted: Vec<(Vec<u32>, Vec<u32>)> = part
            .clone()
            .into_par_iter()
            .map(|run| {
                let first_row = run * SORTED_TOGETHER;
                let rows = SORTED_TOGETHER.min(world.rows() - first_row);
                let of_jobs: Vec<&[u64]> = laid_out
                    .iter()
                    .map(|job| &job[run - part.start][..])
                    .collect();
                sort(&of_jobs, rows)
            })
            .collect();
        for (of_rows, of_run) in sorted {
            lengths.extend(of_rows);
            ends.extend(of_run);
        }
    }
    Ok(BatchRows::new(&lengths, ends))
}

/// Sorts the entries of a run by row, then by what is seen; gives the length of each row, and what they see.
fn sort(of_jobs: &[&[u64]], rows: usize) -> (Vec<u32>, Vec<u32>) {
    let mut lengths = vec![0u32; rows];
    for entry in of_jobs.iter().copied().flatten() {
        lengths[(entry >> 32) as usize] += 1;
    }
    let mut total = 0;
    let mut next: Vec<usize> = lengths
        .iter()
        .map(|&length| {
            total += length as usize;
            total - length as usize
        })
        .collect();
    let mut ends = vec![0u32; total];
    for entry in of_jobs.iter().copied().flatten() {
        let place = &mut next[(entry >> 32) as usize];
        ends[*place] = *entry as u32;
        *place += 1;
    }
    let mut rest = &mut ends[..];
    for &length in &lengths {
        let (row, left) = rest.split_at_mut(length as usize);
        row.sort_unstable();
        rest = left;
    }
    (lengths, ends)
}

struct Job<'a> {
    packed: &'a [u8],
    /// The scene's row of each row of the block.
    rows: &'a [u32],
    ends: u32,
    /// Entries of a run, on average.
    of_a_run: usize,
}

impl Job<'_> {
    /// The entries of some runs: for each of them, the place of the row in the run, and what it sees.
    fn lay_out(&self, runs: &Range<usize>) -> Result<Vec<Vec<u64>>, PackedFault> {
        let shape = Shape {
            rows: self.rows.len() as u32,
            ends: self.ends,
        };
        // most runs have as many, give or take a quarter
        let room = self.of_a_run / 4 * 5;
        let mut laid_out: Vec<Vec<u64>> = runs.clone().map(|_| Vec::with_capacity(room)).collect();
        let mut put = |row: u32, end: u32| {
            let (run, place) = (
                row as usize / SORTED_TOGETHER,
                row as usize % SORTED_TOGETHER,
            );
            if let Some(of) = run
                .checked_sub(runs.start)
                .and_then(|k| laid_out.get_mut(k))
            {
                of.push((place as u64) << 32 | u64::from(end));
            }
        };
        let row = |of: u32| self.rows[of as usize];
        packed::for_each_pair(self.packed, shape, |a, b, mutual| {
            if mutual {
                // rows have the numbers of the ends that they are of
                put(row(a), row(b));
                put(row(b), row(a));
            } else {
                put(row(a), b);
            }
        })?;
        Ok(laid_out)
    }
}
