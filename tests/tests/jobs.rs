//! However a solve is cut into blocks and jobs, the rows are the same to the last bit.

#![allow(clippy::unwrap_used)]

use std::sync::Arc;

use nestrad_common::generate::{Generated, Maize, Stand};
use nestrad_common::options::Diameter;
use nestrad_common::problem::Problem;
use nestrad_master::exchange::{
    Assembly, BlockOf, Exchange, ExchangeError, JobCounts, JobOf, JobRows, Sampling,
    SmallestWorker, batches, block_message, demand, partition, split, trace_here,
};
use nestrad_master::plan::Settings;
use nestrad_master::world::World;
use nestrad_tests::canopies::{par_and_nir, problem, small_maize, uniform_sky};
use nestrad_tests::solving::{coarse, plan};
use nestrad_worker::Demand;

/// A canopy with its world and a sampling of four batches.
fn setting(generated: &Generated, diameter: Diameter) -> (Problem, World, Sampling) {
    let problem = problem(generated, &par_and_nir(), uniform_sky(2, 2));
    let settings = Settings {
        diameter,
        ..coarse()
    };
    let plan = plan(&problem, &settings);
    let world = plan.world(&problem);
    let mut sampling = plan.sampling.unwrap();
    sampling.batches = 4;
    (problem, world, sampling)
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

/// Computes all jobs, last ones first, and puts them together.
fn by_jobs(
    problem: &Problem,
    world: &World,
    blocks: &[BlockOf],
    sampling: &Sampling,
    jobs: Vec<JobOf>,
) -> Exchange {
    let batches = batches(sampling);
    let jobs: Arc<[JobOf]> = jobs.into();
    let mut assembly = Assembly::new(world, blocks, jobs.clone(), sampling.batches);
    for (block, of) in blocks.iter().enumerate() {
        let message = block_message(&problem.scene, world, of);
        // a worker refuses a block that takes more than the master announces
        let announced = demand(world, of, sampling).block_bytes();
        assert!(Demand::of_message(&message).block_bytes() <= announced);
        let geometry = nestrad_worker::Block::new(&message).unwrap();
        let tracer = nestrad_worker::Tracer::new(&geometry);
        for (k, job) in jobs
            .iter()
            .enumerate()
            .rev()
            .filter(|(_, j)| j.block == block)
        {
            let batch = job.message(&batches[job.batch as usize]);
            let rows: JobRows = nestrad_worker::trace_packed(&geometry, || &tracer, &batch).into();
            assembly.put(k, rows.clone()).unwrap();
            assembly.put(k, rows).unwrap();
        }
    }
    assembly.finish(JobCounts::default()).unwrap()
}

#[test]
fn jobs_of_parts_of_lines_and_of_rays_give_the_bits_of_one_job() {
    for diameter in [Diameter::Infinite, Diameter::Metres(0.3)] {
        let (problem, world, sampling) = setting(&small_maize(), diameter);
        let blocks = [BlockOf::whole(&world)];
        let whole = trace_here(&problem.scene, &world, &blocks, &sampling, || Ok(())).unwrap();
        let mut jobs = Vec::new();
        for batch in batches(&sampling) {
            let job = |lines, part, rays| JobOf {
                block: 0,
                batch: batch.index,
                lines,
                part,
                rays,
                cost_s: 1.0,
            };
            let end = batch.lines.len();
            jobs.push(job(0..3, (0, 1), None));
            jobs.extend((0..5).map(|p| job(3..4, (p, 5), None)));
            jobs.push(job(4..end, (0, 1), None));
            jobs.extend((0..3).map(|p| job(end..end, (0, 1), Some((p, 3)))));
        }
        let cut = by_jobs(&problem, &world, &blocks, &sampling, jobs);
        assert!(whole.halves == cut.halves, "{diameter}: rows differ");
        assert_eq!(whole.counters, cut.counters);
    }
}

#[test]
fn blocks_with_what_is_near_give_the_bits_of_the_whole_scene() {
    let (problem, world, sampling) = setting(&rows_of_maize(), Diameter::Metres(0.2));
    let whole = [BlockOf::whole(&world)];
    let needed = demand(&world, &whole[0], &sampling).worker_bytes(1, 1);
    let fixed = Demand::default().worker_bytes(1, 0);
    let worker = SmallestWorker {
        memory_bytes: fixed + (needed - fixed) * 2 / 3,
        threads: 1,
    };
    let blocks = partition(&problem.scene, &world, &sampling, worker).unwrap();
    assert!(blocks.len() > 2, "{} blocks", blocks.len());
    for block in &blocks {
        let needed = demand(&world, block, &sampling).worker_bytes(1, 2);
        assert!(needed <= worker.memory_bytes);
        let halo = block.triangles.iter().any(|&(_, owned)| !owned);
        assert!(halo && block.triangles.len() < problem.scene.triangles.len());
    }
    let jobs = split(&world, &blocks, &batches(&sampling), &sampling);
    let cut = by_jobs(&problem, &world, &blocks, &sampling, jobs);
    let whole = trace_here(&problem.scene, &world, &whole, &sampling, || Ok(())).unwrap();
    assert!(whole.halves == cut.halves, "rows differ");
}

#[test]
fn every_row_is_in_one_block() {
    let (problem, world, sampling) = setting(&rows_of_maize(), Diameter::Metres(0.2));
    let fixed = Demand::default().worker_bytes(2, 0);
    let worker = |memory_bytes| SmallestWorker {
        memory_bytes,
        threads: 2,
    };
    let mut fewest = usize::MAX;
    for more in [1 << 20, 4 << 20, 16 << 20, 1 << 40] {
        let cut = partition(&problem.scene, &world, &sampling, worker(fixed + more));
        let Ok(blocks) = cut else { continue };
        let (mut triangles, mut cells): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
        for block in &blocks {
            triangles.extend(block.triangles.iter().filter(|t| t.1).map(|t| t.0));
            cells.extend(&block.soil_cells);
            assert!(block.triangles.is_sorted() && block.soil_cells.is_sorted());
        }
        triangles.sort_unstable();
        cells.sort_unstable();
        assert!(
            triangles
                .into_iter()
                .eq(0..problem.scene.triangles.len() as u32)
        );
        assert!(cells.into_iter().eq(0..world.ends.soil_cells));
        assert!(blocks.len() <= fewest);
        fewest = blocks.len();
    }
    assert_eq!(fewest, 1);
}

#[test]
fn a_worker_that_is_too_small_is_told_what_it_takes() {
    for (diameter, hint) in [(Diameter::Infinite, true), (Diameter::Metres(0.2), false)] {
        let (problem, world, sampling) = setting(&small_maize(), diameter);
        let worker = SmallestWorker {
            memory_bytes: 1 << 20,
            threads: 1,
        };
        let error = partition(&problem.scene, &world, &sampling, worker).unwrap_err();
        assert!(matches!(error, ExchangeError::BlockTooLarge { .. }));
        assert_eq!(error.to_string().contains("--diameter"), hint, "{error}");
    }
}
