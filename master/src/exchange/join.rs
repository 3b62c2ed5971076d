//! Packed rows of the jobs of a batch, joined into the rows of the scene.
//!
//! Jobs are read at the same time, and their entries laid out by runs of rows; then runs are sorted at the same
//! time. In which order entries come to a row is a matter of chance; sorted, they are what they are.

use nestrad_proto::packed::{self, PackedFault, Shape};
use rayon::prelude::*;

use super::assembly::JobRows;
use super::jobs::BlockOf;
use super::rows::BatchRows;
use crate::world::World;

/// Rows that are sorted together: their counters fit a first-level cache.
const SORTED_TOGETHER: usize = 1 << 13;

/// Entries of each run of each job, and room for those of the next batch: a join in memory that was never touched takes
/// a third longer.
#[derive(Debug, Default)]
pub(super) struct LaidOut(Vec<Vec<Vec<u64>>>);

/// Joins the jobs of all blocks of a batch.
pub(super) fn join(
    world: &World,
    parts: &[(&BlockOf, Vec<JobRows>)],
    LaidOut(laid_out): &mut LaidOut,
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
    laid_out.resize(jobs.len(), Vec::new());
    jobs.par_iter()
        .zip(&mut *laid_out)
        .try_for_each(|(job, laid_out)| job.lay_out(runs, laid_out))?;
    let of_run = |run: usize| -> Vec<&[u64]> { laid_out.iter().map(|job| &job[run][..]).collect() };
    let entries = laid_out.iter().flatten().map(Vec::len).sum();
    let (mut lengths, mut ends) = (vec![0; world.rows()], vec![0; entries]);
    let (mut tasks, mut rest) = (Vec::with_capacity(runs), &mut ends[..]);
    for (run, lengths) in lengths.chunks_mut(SORTED_TOGETHER).enumerate() {
        let of_jobs = of_run(run);
        let (own, left) = rest.split_at_mut(of_jobs.iter().map(|job| job.len()).sum());
        tasks.push((of_jobs, lengths, own));
        rest = left;
    }
    tasks
        .into_par_iter()
        .for_each(|(of_jobs, lengths, ends)| sort(&of_jobs, lengths, ends));
    Ok(BatchRows::new(&lengths, ends))
}

/// Sorts the entries of a run by row, then by what is seen: the length of each row, and what they see.
fn sort(of_jobs: &[&[u64]], lengths: &mut [u32], ends: &mut [u32]) {
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
    for entry in of_jobs.iter().copied().flatten() {
        let place = &mut next[(entry >> 32) as usize];
        ends[*place] = *entry as u32;
        *place += 1;
    }
    let mut rest = ends;
    for &length in lengths.iter() {
        let (row, left) = rest.split_at_mut(length as usize);
        row.sort_unstable();
        rest = left;
    }
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
    /// The entries of each run: the place of the row in the run, and what it sees.
    fn lay_out(&self, runs: usize, laid_out: &mut Vec<Vec<u64>>) -> Result<(), PackedFault> {
        let shape = Shape {
            rows: self.rows.len() as u32,
            ends: self.ends,
        };
        // most runs have as many, give or take a quarter
        let room = self.of_a_run / 4 * 5;
        laid_out.resize(runs, Vec::new());
        for entries in &mut *laid_out {
            entries.clear();
            entries.reserve(room);
        }
        let mut put = |row: u32, end: u32| {
            let (run, place) = (
                row as usize / SORTED_TOGETHER,
                row as usize % SORTED_TOGETHER,
            );
            laid_out[run].push((place as u64) << 32 | u64::from(end));
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
        })
    }
}
