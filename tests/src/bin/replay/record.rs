//! Times and sizes of real jobs.

use std::fmt;

use glam::DVec2;
use nestrad_common::generate::{Maize, Stand};
use nestrad_common::scene::Scene;
use nestrad_engine::exchange::{Assembly, BlockOf, JobCounts, JobOf, JobRows, Work, demand};
use nestrad_engine::frame::Frame;
use nestrad_engine::plan::{Aims, Settings};
use nestrad_engine::stopwatch::cpu_seconds;
use nestrad_kernel::packed::{self, Shape};
use nestrad_kernel::{Demand, PackedRows, Tracer, trace};
use nestrad_proto::{near_field, v1};
use nestrad_tests::canopies::{par_and_nir, scenery, uniform_sky};
use nestrad_tests::solving::{aimed, frame};
use prost::Message;

/// A job as it was measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job {
    pub(crate) batch: u32,
    /// What the master expects it to take, seconds.
    pub(crate) cost_s: f64,
    /// What it takes of a processor, packing included, seconds.
    pub(crate) took_s: f64,
    /// Packed rows, bytes.
    pub(crate) bytes: u64,
    pub(crate) entries: u64,
    /// It casts rays, for which a tree is built.
    pub(crate) rays: bool,
}

/// A recorded solve. All times are processor seconds of one thread.
#[derive(Clone, Debug)]
pub(crate) struct Recorded {
    pub(crate) triangles: usize,
    measured: usize,
    pub(crate) block_bytes: u64,
    /// To make a block ready, and its tree.
    pub(crate) ready_s: f64,
    pub(crate) tree_s: f64,
    pub(crate) demand: Demand,
    pub(crate) jobs: Vec<Job>,
    /// What the master takes for an entry to check it, and to join it into rows.
    pub(crate) check_s: f64,
    pub(crate) join_s: f64,
}

/// What is solved.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
    pub(crate) rows: u32,
    /// Without bare soil.
    pub(crate) dense: bool,
    pub(crate) accuracy_percent: f64,
}

/// Rows of maize, on one half of the ground or all of it.
fn canopy(rows: u32, dense: bool) -> Scene {
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
    if !dense {
        // the pattern is twice as wide as what grows on it
        field.pattern.size_m *= DVec2::new(2.0, 1.0);
    }
    scenery(&field, &par_and_nir(), uniform_sky(4, 2)).scene()
}

impl Recorded {
    /// Computes the jobs of a batch, and every so many of the others, each on one thread.
    pub(crate) fn measure(field: Field, every: usize) -> Self {
        let scene = canopy(field.rows, field.dense);
        let settings = Settings {
            accuracy_percent: field.accuracy_percent,
            // jobs are recorded, not solved with
            memory_GiB: 1e6,
            ..Settings::default()
        };
        // what rounds come to in maize: elements are fine enough as they are by default
        let aims = Aims {
            elements_percent: Aims::of(settings.accuracy_percent)
                .elements_percent
                .max(0.5),
            ..Aims::of(settings.accuracy_percent)
        };
        let plan = aimed(&scene, &settings, &aims).trace;
        let (frame, sampling) = (frame(&scene.canopy, &plan), plan.sampling.unwrap());
        let work = Work::split(&frame, &sampling, vec![BlockOf::whole(&frame)]);
        let whole = &work.blocks[0];
        let message = near_field::block_message(&whole.frame(&frame), whole.corners(&frame));
        let encoded = message.unwrap().encode_to_vec();
        let begun_s = cpu_seconds();
        let message = v1::Block::decode(&encoded[..]).unwrap();
        let block = near_field::block(&message).unwrap();
        let ready_s = cpu_seconds() - begun_s;
        let one = rayon::ThreadPoolBuilder::new()
            .num_threads(1)
            .build()
            .unwrap();
        let begun_s = cpu_seconds();
        let tracer = one.install(|| Tracer::new(&block));
        let tree_s = cpu_seconds() - begun_s;
        let (mut results, mut measured) = (Vec::<PackedRows>::new(), 0);
        let mut measure = |number: usize, job: &JobOf| {
            let batch = work.batch(number);
            let begun_s = cpu_seconds();
            let rows = one.install(|| trace(&block, || &tracer, &batch).packed(&block));
            let took_s = cpu_seconds() - begun_s;
            if job.batch == 0 {
                results.push(rows.clone());
            }
            measured += 1;
            Job {
                batch: job.batch,
                cost_s: job.cost_s,
                took_s,
                bytes: rows.packed.len() as u64,
                entries: rows.counts.row_entries,
                rays: batch.rays.is_some(),
            }
        };
        // the first batch whole, as a master joins it; the others take the time and size of the last one of their kind
        let (mut jobs, mut last) = (Vec::new(), [None, None]);
        let mut seen = [0, 0];
        for (number, job) in work.jobs.iter().enumerate() {
            let kind = usize::from(job.rays.is_some());
            let this = last[kind].filter(|_| job.batch > 0 && seen[kind] % every != 0);
            let this: Job = this.unwrap_or_else(|| measure(number, job));
            seen[kind] += 1;
            last[kind] = Some(this);
            jobs.push(Job {
                batch: job.batch,
                cost_s: job.cost_s,
                ..this
            });
        }
        let [check_s, join_s] = one.install(|| master_s(&frame, &work, &results));
        Self {
            triangles: scene.canopy.len(),
            measured,
            block_bytes: encoded.len() as u64,
            ready_s,
            tree_s,
            demand: demand(&frame, whole, &sampling),
            jobs,
            check_s,
            join_s,
        }
    }

    pub(crate) fn jobs_s(&self) -> f64 {
        self.jobs.iter().map(|j| j.took_s).sum()
    }
}

/// What a master takes for an entry to check it, and to join it into the rows of its batch.
fn master_s(frame: &Frame, work: &Work, results: &[PackedRows]) -> [f64; 2] {
    let shape = Shape {
        rows: frame.rows() as u32,
        ends: frame.ends.len() as u32,
    };
    let entries: u64 = results.iter().map(|r| r.counts.row_entries).sum();
    let begun_s = cpu_seconds();
    for rows in results {
        assert_eq!(blake3::hash(&rows.packed).as_bytes().len(), 32);
        packed::check(&rows.packed, shape, rows.counts.row_entries).unwrap();
    }
    let check_s = cpu_seconds() - begun_s;
    // a master joins batch after batch: the first one finds memory that was never touched
    let first = &work.jobs[..results.len()];
    let second = first.iter().map(|job| JobOf {
        batch: 1,
        ..job.clone()
    });
    let both = Work {
        batches: work.batches[..2].to_vec(),
        jobs: first.iter().cloned().chain(second).collect(),
        ..work.clone()
    };
    let mut assembly = Assembly::new(frame, &both);
    let rows: Vec<JobRows> = results
        .iter()
        .map(|rows| JobRows::Packed(rows.clone().into()))
        .collect();
    let mut join = |from: usize| {
        let begun_s = cpu_seconds();
        for (job, rows) in rows.iter().enumerate() {
            assembly.put(from + job, rows.clone()).unwrap();
        }
        cpu_seconds() - begun_s
    };
    join(0);
    let join_s = join(rows.len());
    let begun_s = cpu_seconds();
    assert!(assembly.finish(JobCounts::default()).is_some());
    let halves_s = 0.5 * (cpu_seconds() - begun_s);
    [check_s, join_s + halves_s].map(|s| s / entries as f64)
}

impl fmt::Display for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut took: Vec<f64> = self.jobs.iter().map(|j| j.took_s).collect();
        took.sort_by(f64::total_cmp);
        let bytes: u64 = self.jobs.iter().map(|j| j.bytes).sum();
        let entries: u64 = self.jobs.iter().map(|j| j.entries).sum();
        let cost_s: f64 = self.jobs.iter().map(|j| j.cost_s).sum();
        let rays = self.jobs.iter().filter(|j| j.rays).count();
        writeln!(f, "triangles {}", self.triangles)?;
        writeln!(
            f,
            "jobs {}, {rays} with rays, measured {}",
            self.jobs.len(),
            self.measured
        )?;
        writeln!(
            f,
            "a job: least {:.3} s, median {:.3} s, most {:.3} s; all {:.1} s, expected {cost_s:.1} s",
            took[0],
            took[took.len() / 2],
            took[took.len() - 1],
            self.jobs_s()
        )?;
        writeln!(
            f,
            "results {:.1} MB, {:.2} bytes an entry; the master takes {:.1} ns to check one and {:.1} ns to join it",
            bytes as f64 * 1e-6,
            bytes as f64 / entries as f64,
            self.check_s * 1e9,
            self.join_s * 1e9
        )?;
        write!(
            f,
            "block {:.1} MB, {:.1} bytes a triangle, ready in {:.2} s, its tree in {:.2} s",
            self.block_bytes as f64 * 1e-6,
            self.block_bytes as f64 / self.triangles as f64,
            self.ready_s,
            self.tree_s
        )
    }
}
