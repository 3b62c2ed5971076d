//! The rows of the jobs of a batch, joined into the rows of the scene.
//!
//! Jobs are read at the same time, and their entries laid out by runs of rows; then runs are sorted at the same
//! time. In which order entries come to a row is a matter of chance; sorted, they are what they are.

use nestrad_kernel::Rows;
use nestrad_kernel::packed::{self, Shape};
use rayon::prelude::*;

use super::ExchangeError;
use super::blocks::BlockOf;
use super::rows::BatchRows;
use super::source::JobRows;
use crate::frame::Frame;

/// Rows that are sorted together: their counters fit a first-level cache.
const SORTED_TOGETHER: usize = 1 << 13;

/// Entries of each run of each job, and room for those of the next batch: a join in memory that was never touched takes
/// a third longer.
#[derive(Debug, Default)]
pub(super) struct LaidOut(Vec<Vec<Vec<u64>>>);

/// Joins the jobs of all blocks of a batch.
pub(super) fn join(
    frame: &Frame,
    mut parts: Vec<(&BlockOf, Vec<JobRows>)>,
    LaidOut(laid_out): &mut LaidOut,
) -> Result<BatchRows, ExchangeError> {
    // one job of one block that is the scene: its rows are the scene's, in order
    if let [(block, jobs)] = &mut parts[..]
        && let [JobRows::Plain(rows)] = &mut jobs[..]
        && block.is_whole(frame)
    {
        check(rows, frame.rows(), frame.ends.len())?;
        return Ok(BatchRows::new(
            &rows.lengths,
            std::mem::take(&mut rows.ends),
        ));
    }
    let runs = frame.rows().div_ceil(SORTED_TOGETHER);
    let rows_of: Vec<Vec<u32>> = parts
        .par_iter()
        .map(|(block, _)| block.rows(frame))
        .collect();
    let jobs: Vec<Job> = parts
        .iter()
        .zip(&rows_of)
        .flat_map(|((_, jobs), rows)| {
            jobs.iter().map(|result| Job {
                result,
                rows,
                ends: frame.ends.len(),
                of_a_run: result.counts().row_entries as usize / runs.max(1),
            })
        })
        .collect();
    laid_out.resize(jobs.len(), Vec::new());
    jobs.par_iter()
        .zip(&mut *laid_out)
        .try_for_each(|(job, laid_out)| job.lay_out(runs, laid_out))?;
    let of_run = |run: usize| -> Vec<&[u64]> { laid_out.iter().map(|job| &job[run][..]).collect() };
    let entries = laid_out.iter().flatten().map(Vec::len).sum();
    let (mut lengths, mut ends) = (vec![0; frame.rows()], vec![0; entries]);
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

/// Refuses rows that are not those of a block with so many rows, in a world of so many ends.
fn check(rows: &Rows, expected: usize, ends: usize) -> Result<(), ExchangeError> {
    let entries = rows.lengths.iter().map(|&l| l as usize).sum();
    for (what, found, expected) in [
        ("rows", rows.lengths.len(), expected),
        ("entries", rows.ends.len(), entries),
    ] {
        if found != expected {
            return Err(ExchangeError::Result {
                what,
                found,
                expected,
            });
        }
    }
    match rows.ends.iter().find(|&&end| end as usize >= ends) {
        None => Ok(()),
        Some(&end) => Err(ExchangeError::Result {
            what: "as the number of something seen",
            found: end as usize,
            expected: ends,
        }),
    }
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
    result: &'a JobRows,
    /// The scene's row of each row of the block.
    rows: &'a [u32],
    ends: usize,
    /// Entries of a run, on average.
    of_a_run: usize,
}

impl Job<'_> {
    /// The entries of each run: the place of the row in the run, and what it sees.
    fn lay_out(&self, runs: usize, laid_out: &mut Vec<Vec<u64>>) -> Result<(), ExchangeError> {
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
        match self.result {
            JobRows::Plain(rows) => {
                check(rows, self.rows.len(), self.ends)?;
                let mut ends = &rows.ends[..];
                for (&row, &length) in self.rows.iter().zip(&rows.lengths) {
                    let (own, rest) = ends.split_at(length as usize);
                    own.iter().for_each(|&end| put(row, end));
                    ends = rest;
                }
            }
            JobRows::Packed(rows) => {
                let shape = Shape {
                    rows: self.rows.len() as u32,
                    ends: self.ends as u32,
                };
                packed::for_each_pair(&rows.packed, shape, |a, b, mutual| {
                    if mutual {
                        // rows have the numbers of the ends that they are of
                        put(row(a), row(b));
                        put(row(b), row(a));
                    } else {
                        put(row(a), b);
                    }
                })?;
            }
        }
        Ok(())
    }
}
