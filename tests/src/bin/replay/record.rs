//! Times and sizes of real jobs.

use std::fmt;
use std::time::Instant;

use glam::DVec2;
use nestrad_common::generate::{Maize, Stand};
use nestrad_master::exchange::{BlockOf, JobOf, JobRows, batches, block_message, demand, split};
use nestrad_master::plan::Settings;
use nestrad_tests::canopies::{par_and_nir, problem, uniform_sky};
use nestrad_tests::solving::plan;
use nestrad_worker::Demand;
use prost::Message;

/// A job as it was measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job {
    /// What the master expects it to take, seconds.
    pub(crate) cost_s: f64,
    /// What it took on one thread, packing included, seconds.
    pub(crate) took_s: f64,
    /// Packed rows, bytes.
    pub(crate) bytes: u64,
    /// It casts rays, for which a tree is built.
    pub(crate) rays: bool,
}

/// A recorded solve.
#[derive(Clone, Debug)]
pub(crate) struct Recorded {
    pub(crate) triangles: usize,
    pub(crate) measured: usize,
    pub(crate) entries: u64,
    pub(crate) block_bytes: u64,
    /// Time to make a block ready, without and with its tree, seconds.
    pub(crate) ready_s: [f64; 2],
    pub(crate) demand: Demand,
    pub(crate) jobs: Vec<Job>,
}

impl Recorded {
    /// Computes every so many jobs of a field whose other half is bare.
    pub(crate) fn measure(rows: u32, every: usize) -> Self {
        let mut field = Maize {
            stand: Stand {
                rows,
                plants_per_row: 40,
                row_spacing_m: 0.8,
                plant_spacing_m: 0.13,
            },
            leaf_triangle_m2: 1.5e-4,
            seed: 11,
        }
        .generate()
        .unwrap();
        // the pattern is twice as wide as what grows on it
        field.pattern.size_m *= DVec2::new(2.0, 1.0);
        let problem = problem(&field, &par_and_nir(), uniform_sky(4, 2));
        let settings = Settings {
            memory_GiB: 64.0,
            ..Settings::default()
        };
        let plan = plan(&problem, &settings);
        let (world, sampling) = (plan.world(&problem), plan.sampling.unwrap());
        let blocks = [BlockOf::whole(&world)];
        let batches = batches(&sampling);
        let of = split(&world, &blocks, &batches, &sampling);
        let message = block_message(&problem.scene, &world, &blocks[0]);
        let block_bytes = message.encoded_len() as u64;
        let begun = Instant::now();
        let block = nestrad_worker::Block::new(&message).unwrap();
        let without_s = begun.elapsed().as_secs_f64();
        let tracer = nestrad_worker::Tracer::new(&block);
        let ready_s = [without_s, begun.elapsed().as_secs_f64()];
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let mut entries = 0;
        let mut measure = |job: &JobOf| {
            let batch = job.message(&batches[job.batch as usize]);
            let begun = Instant::now();
            let rows = one.install(|| {
                let rows = if batch.rays.is_some() {
                    nestrad_worker::trace(&block, &tracer, &batch)
                } else {
                    nestrad_worker::trace_lines(&block, &batch)
                };
                JobRows::pack(&rows, world.ends.len())
            });
            entries += rows.traced.row_entries;
            Job {
                cost_s: job.cost_s,
                took_s: begun.elapsed().as_secs_f64(),
                bytes: rows.packed.len() as u64,
                rays: batch.rays.is_some(),
            }
        };
        let (mut jobs, mut last): (Vec<Job>, Option<(bool, Job)>) = (Vec::new(), None);
        let mut measured = 0;
        for (k, job) in of.iter().enumerate() {
            let rays = job.rays.is_some();
            let known = last.filter(|(of_rays, _)| k % every != 0 && *of_rays == rays);
            let this = known.map_or_else(
                || {
                    measured += 1;
                    measure(job)
                },
                |(_, job)| job,
            );
            last = Some((rays, this));
            jobs.push(Job {
                cost_s: job.cost_s,
                ..this
            });
        }
        Self {
            triangles: problem.scene.triangles.len(),
            measured,
            entries,
            block_bytes,
            ready_s,
            demand: demand(&world, &blocks[0], &sampling),
            jobs,
        }
    }

    /// The same with so many times the directions. Rays do not grow with them: they stand in for lines
    /// where these are few.
    #[must_use]
    pub(crate) fn times(&self, times: u32) -> Self {
        let copies = |job: &Job| {
            let copies = if job.rays { 1 } else { times as usize };
            std::iter::repeat_n(*job, copies)
        };
        Self {
            jobs: self.jobs.iter().flat_map(copies).collect(),
            ..self.clone()
        }
    }
}

impl fmt::Display for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut took: Vec<f64> = self.jobs.iter().map(|j| j.took_s).collect();
        took.sort_by(f64::total_cmp);
        let bytes: u64 = self.jobs.iter().map(|j| j.bytes).sum();
        let total_s: f64 = took.iter().sum();
        let cost_s: f64 = self.jobs.iter().map(|j| j.cost_s).sum();
        writeln!(f, "triangles {}", self.triangles)?;
        writeln!(
            f,
            "jobs {}, of which measured {}",
            self.jobs.len(),
            self.measured
        )?;
        writeln!(
            f,
            "a job: least {:.3} s, median {:.3} s, most {:.3} s; all {total_s:.1} s, expected {cost_s:.1} s",
            took[0],
            took[took.len() / 2],
            took[took.len() - 1]
        )?;
        writeln!(
            f,
            "results {:.1} MB; entries of the measured ones {}",
            bytes as f64 * 1e-6,
            self.entries
        )?;
        write!(
            f,
            "block {:.1} MB, ready in {:.2} s, with tree {:.2} s",
            self.block_bytes as f64 * 1e-6,
            self.ready_s[0],
            self.ready_s[1]
        )
    }
}
