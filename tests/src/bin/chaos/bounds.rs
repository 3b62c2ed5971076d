//! What must hold, from `master/docs/operators.md`: the times there, and the limits that the master is given.

use std::time::Duration;

/// Programs of each kind.
pub(crate) const WORKERS: usize = 5;
pub(crate) const CLIENTS: usize = 10;

/// Limits of the master: short times, so that what they end is seen often.
pub(crate) const LEASE_S: f64 = 2.0;
pub(crate) const PATIENCE_S: f64 = 5.0;
pub(crate) const DRAIN_S: u64 = 10;
pub(crate) const SOLVES: u32 = 2;
pub(crate) const QUEUE: u32 = 200;
pub(crate) const SOLVE_GIB: f64 = 0.25;
pub(crate) const SCENE_GIB: f64 = 0.05;
pub(crate) const RESULT_GIB: f64 = 0.05;

/// Of a worker.
pub(crate) const WORKER_GIB: f64 = 0.25;

/// What the master may take, bytes: held scenes, held results, and its solves. Besides, the program itself with
/// its threads and connections, and what the allocator has not given back yet.
pub(crate) const MEMORY_BYTES: f64 =
    (SCENE_GIB + RESULT_GIB + SOLVES as f64 * SOLVE_GIB) * GIB + 128.0 * MIB;
pub(crate) const GIB: f64 = (1u64 << 30) as f64;
const MIB: f64 = (1u64 << 20) as f64;

/// Connections are 4096 at most. Besides, files, pipes and ports of the master itself.
pub(crate) const FILES: u64 = 4096 + 64;

/// A master that went away is given up after this.
const AWAY_S: u64 = 60;

/// A peer is asked whether it lives after 20 s of silence, and given up 20 s later.
const SILENCE_S: u64 = 40;

/// A solve of one of these scenes takes 2 s; its jobs are lost twice (a lease), its workers go (the patience),
/// and two cores are shared with others.
const SOLVE_S: u64 = 30;

/// No client takes longer, times in which it was stopped not counted: the others may be before it.
pub(crate) const CLIENT: Duration =
    Duration::from_secs(AWAY_S + SILENCE_S + CLIENTS as u64 * SOLVE_S);

/// Some client ends at least as often as this, at any time.
pub(crate) const STANDSTILL: Duration = Duration::from_secs(AWAY_S + SILENCE_S + SOLVE_S);

/// The master tells how it is within this, where it is not stopped.
pub(crate) const ANSWER: Duration = Duration::from_secs(10);

/// The master has ended on SIGTERM: what is not done is cancelled, clients fetch and hang up.
pub(crate) const STOPPED: Duration = Duration::from_secs(DRAIN_S + 15);

/// A worker has ended on SIGTERM.
pub(crate) const WORKER_STOPPED: Duration = Duration::from_secs(15);

/// A master that was started serves.
pub(crate) const STARTED: Duration = Duration::from_secs(20);

/// All is as before when faults are over: peers that were silent are given up, solves that nobody waits for are
/// done.
pub(crate) const AT_REST: Duration = Duration::from_secs(120 + SILENCE_S);
