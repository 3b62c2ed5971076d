//! However a solve is cut into blocks and jobs, the rows are the same to the last bit.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use nestrad_common::generate::{Generated, Maize, Stand};
use nestrad_common::options::Diameter;
use nestrad_engine::exchange::{
    Assembly, BlockOf, Exchange, ExchangeError, JobCounts, JobOf, JobRows, Ready, Sampling,
    SmallestWorker, ThisProcess, Work, demand, partition,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::plan::Settings;
use nestrad_kernel::expected::{OfBlock, RowsFault};
use nestrad_kernel::job::Batch;
use nestrad_kernel::part::Part;
use nestrad_kernel::rows::Counts;
use nestrad_kernel::{Demand, PackedRows, Tracer};
use nestrad_proto::near_field;
use nestrad_tests::canopies::{par_and_nir, scenery, small_maize, uniform_sky};
use nestrad_tests::lies::Pairs;
use nestrad_tests::random;
use nestrad_tests::solving::{coarse, frame, plan, trace, try_plan};

/// A canopy in its frame, and a sampling of four batches.
fn setting(generated: &Generated, diameter: Diameter) -> (Frame, Sampling) {
    let scene = scenery(generated, &par_and_nir(), uniform_sky(2, 2)).scene();
    let settings = Settings {
        diameter,
        ..coarse()
    };
    let plan = plan(&scene, &settings).trace;
    let mut sampling = plan.sampling.unwrap();
    sampling.batches = 4;
    (frame(&scene.canopy, &plan), sampling)
}

/// Two rows of eight plants of maize, with whole stems.
fn rows_of_maize() -> Generated {
    Maize {
        stand: Stand {
            rows: 2,
            plants_per_row: 8,
            row_spacing_m: 0.8,
            plant_spacing_m: 0.3,
        },
        leaf_triangle_m2: 1e-3,
        seed: 5,
    }
    .generate()
    .unwrap()
}

/// A job before it is traced.
struct Known<'a> {
    frame: &'a Frame,
    of: Arc<OfBlock>,
    block: &'a BlockOf,
    batch: Batch,
}

fn known<'a>(frame: &'a Frame, work: &'a Work, job: usize) -> Known<'a> {
    let block = &work.blocks[work.jobs[job].block];
    Known {
        frame,
        of: Arc::new(OfBlock::new(frame.block(), &block.owned())),
        block,
        batch: work.batch(job),
    }
}

impl Known<'_> {
    /// Checks rows as a master does.
    fn check(&self, rows: &PackedRows) -> Result<(), RowsFault> {
        let (scene, owned) = (self.frame.block(), self.block.owned());
        let job = self.of.job(scene, &owned, &self.batch, &rows.counts)?;
        job.check(&rows.packed)
    }
}

/// Computes all jobs from messages, as a worker does, last ones first, and puts them together.
fn by_jobs(frame: &Frame, work: &Work) -> Exchange {
    let mut assembly = Assembly::new(frame, work);
    for (number, of) in work.blocks.iter().enumerate() {
        let message = near_field::block_message(&of.frame(frame), of.corners(frame)).unwrap();
        // a worker refuses a block that takes more than the master announces
        let announced = demand(frame, of, &work.sampling).block_bytes();
        assert!(near_field::demand(&message).block_bytes() <= announced);
        let block = near_field::block(&message).unwrap();
        let tracer = Tracer::new(&block);
        let own = |k: &usize| work.jobs[*k].block == number;
        for k in (0..work.jobs.len()).rev().filter(own) {
            let batch = near_field::batch(&near_field::batch_message(&work.batch(k)));
            let rows = nestrad_kernel::trace(&block, || &tracer, &batch).packed(&block);
            known(frame, work, k).check(&rows).unwrap();
            let rows = JobRows::Packed(rows.into());
            assembly.put(k, rows.clone()).unwrap();
            assembly.put(k, rows).unwrap();
        }
    }
    assembly.finish(JobCounts::default()).unwrap()
}

#[test]
fn jobs_of_parts_of_lines_and_of_rays_give_the_bits_of_one_job() {
    for diameter in [Diameter::Infinite, Diameter::Metres(0.3)] {
        let (frame, sampling) = setting(&small_maize(), diameter);
        let whole = trace(&frame, &sampling, &ThisProcess::default());
        let mut work = Work::split(&frame, &sampling, vec![BlockOf::whole(&frame)]);
        let mut jobs = Vec::new();
        for batch in &work.batches {
            let job = |lines, part, rays| JobOf {
                block: 0,
                batch: batch.index,
                lines,
                part,
                rays,
                cost_s: 1.0,
            };
            let end = batch.lines.len();
            let all = Part::default();
            jobs.push(job(0..3, all, None));
            jobs.extend((0..5).map(|p| job(3..4, Part::new(p, 5), None)));
            jobs.push(job(4..end, all, None));
            jobs.extend((0..3).map(|p| job(end..end, all, Some(Part::new(p, 3)))));
        }
        work.jobs = jobs.into();
        let cut = by_jobs(&frame, &work);
        assert!(whole.halves == cut.halves, "{diameter}: rows differ");
        assert_eq!(whole.counts, cut.counts);
    }
}

/// Blocks of every other triangle and soil cell, each with all that there is around them.
fn every_other(frame: &Frame) -> Vec<BlockOf> {
    let triangles = frame.organ.len() as u32;
    let block = |odd: u32| BlockOf {
        triangles: (0..triangles).map(|t| (t, t % 2 == odd)).collect(),
        soil_cells: (0..frame.ends.soil_cells)
            .filter(|c| c % 2 == odd)
            .collect(),
    };
    vec![block(0), block(1)]
}

/// Whatever a scene is like, the master never refuses what a right worker brings.
#[test]
fn what_is_known_of_a_job_holds_of_all_right_rows() {
    let tame = (0..40).map(|seed| Ok(random::scenery(seed).scene()));
    let wild = (0..200).map(|seed| random::wild(seed, seed % 2 == 0));
    let (mut jobs, mut rays) = (0, 0);
    for (k, scene) in tame.chain(wild).enumerate() {
        let Ok(scene) = scene else { continue };
        let settings = Settings {
            diameter: [Diameter::Infinite, Diameter::Metres(0.3)][k % 2],
            accuracy_percent: 20.0,
            memory_GiB: 0.25,
            ..Settings::default()
        };
        let Ok(plan) = try_plan(&scene, &settings) else {
            continue;
        };
        let frame = frame(&scene.canopy, &plan.trace);
        let Some(mut sampling) = plan.trace.sampling.filter(|_| frame.rows() < 4000) else {
            continue;
        };
        // no denser than planned: a tall scene on little ground throws a long shadow
        let coarse_m2 = plan.scale.ground_area_m2 / 60.0;
        sampling.line_area_m2 = sampling.line_area_m2.max(coarse_m2);
        sampling.batches = 2;
        sampling.least_samples = f64::from(k as u32 % 3) * 10.0;
        for blocks in [vec![BlockOf::whole(&frame)], every_other(&frame)] {
            let work = Work::split(&frame, &sampling, blocks);
            for job in 0..work.jobs.len() {
                let ready = Ready::of(&work.blocks[work.jobs[job].block], &frame).unwrap();
                let JobRows::Packed(rows) = ready.rows(&work, job) else {
                    panic!("jobs are packed");
                };
                let checked = known(&frame, &work, job).check(&rows);
                assert_eq!(checked, Ok(()), "scene {k}, job {job}");
                jobs += 1;
                rays += rows.counts.rays;
            }
        }
    }
    assert!(jobs > 300 && rays > 1000, "{jobs} jobs, {rays} rays");
}

/// Rows that can be told to be wrong without tracing them again.
#[test]
fn rows_that_cannot_be_are_refused() {
    type Spoil = fn(&mut Pairs);
    let spoilt: [(&str, Spoil); 6] = [
        ("twice", |p| p.mutual.extend(p.mutual.clone())),
        ("without half", |p| {
            let half = p.mutual.len() / 2;
            p.mutual.truncate(half);
        }),
        ("without one", |p| p.mutual.truncate(p.mutual.len() - 1)),
        ("seen from one side", |p| {
            let (row, other) = p.mutual.swap_remove(7);
            p.single.extend([(row, other), (other, row)]);
        }),
        ("at the other face", |p| p.single[5].0 ^= 1),
        ("nothing", |p| *p = Pairs::default()),
    ];
    let (frame, sampling) = setting(&small_maize(), Diameter::Infinite);
    for blocks in [vec![BlockOf::whole(&frame)], every_other(&frame)] {
        let work = Work::split(&frame, &sampling, blocks);
        let ready = Ready::of(&work.blocks[0], &frame).unwrap();
        let JobRows::Packed(rows) = ready.rows(&work, 0) else {
            panic!("jobs are packed");
        };
        let known = known(&frame, &work, 0);
        for (what, spoil) in spoilt {
            let mut pairs = Pairs::of(&rows.packed, known.of.shape());
            spoil(&mut pairs);
            let (packed, row_entries) = pairs.packed(known.of.shape());
            // its worker says what there is
            let counts = Counts {
                row_entries,
                ..rows.counts
            };
            let fault = known.check(&PackedRows { packed, counts });
            assert!(fault.is_err(), "{what}");
        }
        for (what, counts) in [
            (
                "lines",
                Counts {
                    lines: 7,
                    ..rows.counts
                },
            ),
            (
                "rays",
                Counts {
                    rays: 1,
                    ..rows.counts
                },
            ),
            (
                "segments",
                Counts {
                    segments: 7,
                    ..rows.counts
                },
            ),
            (
                "entries",
                Counts {
                    row_entries: 1 << 40,
                    ..rows.counts
                },
            ),
        ] {
            let packed = rows.packed.clone();
            let fault = known.check(&PackedRows { packed, counts });
            assert!(fault.is_err(), "{what}");
        }
    }
}

#[test]
fn blocks_with_what_is_near_give_the_bits_of_the_whole_scene() {
    let (frame, sampling) = setting(&rows_of_maize(), Diameter::Metres(0.2));
    let needed = demand(&frame, &BlockOf::whole(&frame), &sampling).worker_bytes(1, 1);
    let fixed = Demand::default().worker_bytes(1, 0);
    let worker = SmallestWorker {
        memory_bytes: fixed + (needed - fixed) * 2 / 3,
        threads: 1,
    };
    let blocks = partition(&frame, &sampling, worker).unwrap();
    assert!(blocks.len() > 2, "{} blocks", blocks.len());
    for block in &blocks {
        let needed = demand(&frame, block, &sampling).worker_bytes(1, 2);
        assert!(needed <= worker.memory_bytes);
        let halo = block.triangles.iter().any(|&(_, owned)| !owned);
        assert!(halo && block.triangles.len() < frame.organ.len());
    }
    let cut = by_jobs(&frame, &Work::split(&frame, &sampling, blocks));
    let whole = trace(&frame, &sampling, &ThisProcess::default());
    assert!(whole.halves == cut.halves, "rows differ");
}

#[test]
fn every_row_is_in_one_block() {
    let (frame, sampling) = setting(&rows_of_maize(), Diameter::Metres(0.2));
    let fixed = Demand::default().worker_bytes(2, 0);
    let worker = |memory_bytes| SmallestWorker {
        memory_bytes,
        threads: 2,
    };
    let mut fewest = usize::MAX;
    for more in [1 << 20, 4 << 20, 16 << 20, 1 << 40] {
        let cut = partition(&frame, &sampling, worker(fixed + more));
        let Ok(blocks) = cut else { continue };
        let (mut triangles, mut cells): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
        for block in &blocks {
            triangles.extend(block.triangles.iter().filter(|t| t.1).map(|t| t.0));
            cells.extend(&block.soil_cells);
            assert!(block.triangles.is_sorted() && block.soil_cells.is_sorted());
        }
        triangles.sort_unstable();
        cells.sort_unstable();
        assert!(triangles.into_iter().eq(0..frame.organ.len() as u32));
        assert!(cells.into_iter().eq(0..frame.ends.soil_cells));
        assert!(blocks.len() <= fewest);
        fewest = blocks.len();
    }
    assert_eq!(fewest, 1);
}

#[test]
fn a_worker_that_is_too_small_is_told_what_it_takes() {
    for (diameter, hint) in [(Diameter::Infinite, true), (Diameter::Metres(0.2), false)] {
        let (frame, sampling) = setting(&small_maize(), diameter);
        let worker = SmallestWorker {
            memory_bytes: 1 << 20,
            threads: 1,
        };
        let error = partition(&frame, &sampling, worker).unwrap_err();
        assert!(matches!(error, ExchangeError::BlockTooLarge { .. }));
        assert_eq!(error.to_string().contains("--diameter"), hint, "{error}");
    }
}
