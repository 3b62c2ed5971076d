//! However a solve is cut into blocks and jobs, the rows are the same to the last bit.

#![allow(clippy::unwrap_used)]

use nestrad_common::generate::{Generated, Maize, Stand};
use nestrad_common::options::Diameter;
use nestrad_engine::exchange::{
    Assembly, BlockOf, Exchange, ExchangeError, JobCounts, JobOf, JobRows, Sampling,
    SmallestWorker, ThisProcess, Work, demand, partition,
};
use nestrad_engine::frame::Frame;
use nestrad_engine::plan::Settings;
use nestrad_kernel::part::Part;
use nestrad_kernel::{Demand, Tracer};
use nestrad_proto::near_field;
use nestrad_tests::canopies::{par_and_nir, scenery, small_maize, uniform_sky};
use nestrad_tests::solving::{coarse, frame, plan, trace};

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
