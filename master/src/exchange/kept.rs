//! The exchange in this process, with results that were kept from before.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use nestrad_common::scene::Scene;
use nestrad_proto::packed::Shape;
use nestrad_worker::{Tracer, trace_packed};
use prost::Message;
use rayon::prelude::*;

use super::assembly::{Assembly, JobRows};
use super::geometry::{block_here, block_message};
use super::jobs::BlockOf;
use super::split::{JobOf, batches, split};
use super::{Exchange, ExchangeError, JobCounts, Sampling};
use crate::output::progress::Progress;
use crate::store::{self, Key, Store};
use crate::world::World;

/// Traces what is not kept yet, and keeps it.
pub fn trace_kept(
    scene: &Scene,
    world: &World,
    sampling: &Sampling,
    kept: &Store,
    progress: &Progress,
) -> Result<Exchange, ExchangeError> {
    let blocks = [BlockOf::whole(world)];
    // named as what workers compute of it: either serves the other
    let message = block_message(scene, world, &blocks[0]).encode_to_vec();
    let id = *blake3::hash(&message).as_bytes();
    drop(message);
    let batches = batches(sampling);
    let jobs: Arc<[JobOf]> = split(world, &blocks, &batches, sampling).into();
    progress.stage("exchange", jobs.len() as u64);

    let mut assembly = Assembly::new(world, &blocks, jobs.clone(), sampling.batches);
    let shape = Shape {
        rows: world.rows() as u32,
        ends: world.ends.len() as u32,
    };
    let mut missing: Vec<(usize, Key)> = Vec::new();
    for (number, job) in jobs.iter().enumerate() {
        let key = store::key(&id, &job.message(&batches[job.batch as usize]));
        match kept.get(&key, shape) {
            Some(rows) => {
                assembly.put(number, rows)?;
                progress.inc(1);
            }
            None => missing.push((number, key)),
        }
    }
    let counts = JobCounts {
        traced: missing.len() as u64,
        kept: (jobs.len() - missing.len()) as u64,
    };
    if !missing.is_empty() {
        let block = block_here(scene, world, &blocks[0])?;
        let tracer = OnceLock::new();
        let assembly = Mutex::new(&mut assembly);
        missing.into_par_iter().try_for_each(|(number, key)| {
            progress.check()?;
            let job = &jobs[number];
            let batch = job.message(&batches[job.batch as usize]);
            let tracer = || tracer.get_or_init(|| Tracer::new(&block));
            let rows: JobRows = trace_packed(&block, tracer, &batch).into();
            kept.put(key, &rows);
            let mut assembly = assembly.lock().unwrap_or_else(PoisonError::into_inner);
            assembly.put(number, rows)?;
            progress.inc(1);
            Ok::<_, ExchangeError>(())
        })?;
    }
    let exchange = assembly.finish(counts);
    exchange.ok_or_else(|| ExchangeError::Failed("jobs without result".to_owned()))
}
