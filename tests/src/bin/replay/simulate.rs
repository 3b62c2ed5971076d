//! Workers that take the time that real ones took, under the real scheduler.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::time::Duration;

use nestrad_master::cluster::scheduler::{
    BlockSpec, Id, JobSpec, Leased, Rules, Scheduler, WorkerFacts,
};

use super::record::Recorded;

/// What lies between master and workers: one link at the master, which all share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Network {
    pub(crate) bytes_per_s: f64,
    /// Of a call.
    pub(crate) latency_s: f64,
    /// Workers hold the block from an earlier solve.
    pub(crate) blocks_held: bool,
}

/// How a simulated solve went.
pub(crate) struct Run {
    pub(crate) wall_s: f64,
    /// Time of all jobs over wall clock times workers.
    pub(crate) efficiency: f64,
    /// Part of the time in which the link is busy.
    pub(crate) network: f64,
}

/// What happens, by time in nanoseconds, then in the order in which it was planned.
type Event = Reverse<(u64, u64, What)>;

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    /// A worker asks for a job.
    Ask(usize),
    /// A worker has computed its job.
    Computed(usize),
    /// A worker's result has come.
    Returned(usize),
}

struct Worker {
    id: Id,
    ready: bool,
    /// It has built the tree for rays.
    tree: bool,
    computing: Option<Leased>,
    /// What is computed waits for the result before it to be through.
    waits: bool,
    returning: Option<Leased>,
}

impl Worker {
    /// Sends the result that is ready, unless one is on its way; and asks for the next job.
    fn send(
        &mut self,
        w: usize,
        now_s: f64,
        recorded: &Recorded,
        network: Network,
        (link, clock): (&mut Link, &mut Clock),
    ) {
        if !self.waits || self.returning.is_some() {
            return;
        }
        self.waits = false;
        self.returning = self.computing.take();
        if let Some(leased) = self.returning {
            let bytes = recorded.jobs[leased.job].bytes as f64;
            let through_s = link.send(now_s + network.latency_s, bytes / network.bytes_per_s);
            clock.at(through_s, What::Returned(w));
        }
        clock.at(now_s, What::Ask(w));
    }
}

/// What is to happen.
#[derive(Default)]
struct Clock {
    events: BinaryHeap<Event>,
    planned: u64,
}

impl Clock {
    fn at(&mut self, at_s: f64, what: What) {
        self.planned += 1;
        let at_ns = (at_s * 1e9) as u64;
        self.events.push(Reverse((at_ns, self.planned, what)));
    }

    fn next(&mut self) -> Option<(f64, What)> {
        let Reverse((at_ns, _, what)) = self.events.pop()?;
        Some((at_ns as f64 * 1e-9, what))
    }
}

/// A link that sends one thing after the other.
#[derive(Default)]
struct Link {
    free_s: f64,
    busy_s: f64,
}

impl Link {
    /// When something is through that takes so long and may begin at `at_s`.
    fn send(&mut self, at_s: f64, takes_s: f64) -> f64 {
        self.free_s = self.free_s.max(at_s) + takes_s;
        self.busy_s += takes_s;
        self.free_s
    }
}

/// Replays a recorded solve.
pub(crate) fn simulate(recorded: &Recorded, workers: u32, network: Network) -> Run {
    let mut scheduler = Scheduler::new(Rules::default(), 1);
    let jobs = recorded.jobs.iter().map(|j| JobSpec {
        block: 0,
        cost_s: j.cost_s,
    });
    let block = BlockSpec {
        id: [1; 32],
        demand: recorded.demand,
    };
    scheduler.begin(vec![block], jobs.collect());
    let mut crew: Vec<Worker> = (0..workers)
        .map(|_| Worker {
            id: scheduler.join(
                Duration::ZERO,
                WorkerFacts {
                    name: String::new(),
                    threads: 1,
                    memory_bytes: 1 << 40,
                },
            ),
            ready: network.blocks_held,
            tree: false,
            computing: None,
            waits: false,
            returning: None,
        })
        .collect();
    let mut clock = Clock::default();
    let mut link = Link::default();
    for w in 0..crew.len() {
        clock.at(0.0, What::Ask(w));
    }
    let (mut left, mut wall_s) = (recorded.jobs.len(), 0.0);
    while let Some((now_s, what)) = clock.next() {
        let now = Duration::from_secs_f64(now_s);
        match what {
            What::Ask(w) => {
                let worker = &mut crew[w];
                let _ = scheduler.renew(now, worker.id, &[]);
                let Ok(Some(leased)) = scheduler.lease(now, worker.id, &[[1; 32]]) else {
                    // the master looks for stragglers that often
                    if left > 0 {
                        clock.at(now_s + 0.1, What::Ask(w));
                    }
                    continue;
                };
                let mut begins_s = now_s + network.latency_s;
                if !worker.ready {
                    worker.ready = true;
                    let sent = recorded.block_bytes as f64 / network.bytes_per_s;
                    begins_s = link.send(begins_s, sent) + recorded.ready_s[0];
                }
                if recorded.jobs[leased.job].rays && !worker.tree {
                    worker.tree = true;
                    begins_s += recorded.ready_s[1] - recorded.ready_s[0];
                }
                worker.computing = Some(leased);
                let takes_s = recorded.jobs[leased.job].took_s;
                clock.at(begins_s + takes_s, What::Computed(w));
            }
            What::Computed(w) => {
                crew[w].waits = true;
                crew[w].send(w, now_s, recorded, network, (&mut link, &mut clock));
            }
            What::Returned(w) => {
                if let Some(leased) = crew[w].returning.take() {
                    let took_s = recorded.jobs[leased.job].took_s;
                    let used = scheduler.finish(now, crew[w].id, leased.lease, took_s);
                    if used.is_some() {
                        left -= 1;
                        wall_s = now_s;
                    }
                }
                crew[w].send(w, now_s, recorded, network, (&mut link, &mut clock));
            }
        }
    }
    let total_s: f64 = recorded.jobs.iter().map(|j| j.took_s).sum();
    Run {
        wall_s,
        efficiency: total_s / (wall_s * f64::from(workers)),
        network: link.busy_s / wall_s,
    }
}
