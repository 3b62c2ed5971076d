//! Workers that take the time that real ones took, under the real scheduler.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::time::Duration;

use nestrad_cluster::scheduler::{BlockSpec, Id, JobSpec, Leased, Rules, Scheduler, WorkerFacts};

use super::record::Recorded;

/// Workers, and what lies between them and the master: one link at the master, which all share. It carries blocks
/// out, one after the other as the master sends them, and at the same time rows in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    pub(crate) workers: u32,
    pub(crate) threads_each: u32,
    pub(crate) bytes_per_s: f64,
    /// Of a call.
    pub(crate) latency_s: f64,
    /// Workers hold the block from an earlier solve.
    pub(crate) blocks_held: bool,
    /// Threads on which the master checks and joins.
    pub(crate) master_threads: u32,
}

/// How a simulated solve went.
pub(crate) struct Run {
    /// Until the last batch is joined.
    pub(crate) wall_s: f64,
    /// Time of all jobs over wall clock times threads.
    pub(crate) efficiency: f64,
}

/// What happens, by time in nanoseconds, then in the order in which it was planned.
type Event = Reverse<(u64, u64, What)>;

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum What {
    /// A thread asks for a job.
    Ask(usize),
    /// A thread has computed its job.
    Computed(usize),
    /// A thread's result has come.
    Came(usize),
    /// It is checked.
    Checked(usize),
}

struct Worker {
    id: Id,
    /// When it has its block, and its tree, or will have.
    block_s: Option<f64>,
    tree_s: Option<f64>,
}

/// A thread of a worker.
#[derive(Clone, Default)]
struct Thread {
    worker: usize,
    computing: Option<Leased>,
    /// What is computed waits for the result before it to be through.
    waits: bool,
    returning: Option<Leased>,
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

/// What does one thing after the other.
#[derive(Default)]
struct Line {
    free_s: f64,
}

impl Line {
    /// When something is done that takes so long and may begin at `at_s`.
    fn do_for(&mut self, at_s: f64, takes_s: f64) -> f64 {
        self.free_s = self.free_s.max(at_s) + takes_s;
        self.free_s
    }
}

/// Replays a recorded solve.
pub(crate) fn simulate(recorded: &Recorded, setting: Setting) -> Run {
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
    let workers = (0..setting.workers).map(|_| Worker {
        id: scheduler.join(
            Duration::ZERO,
            WorkerFacts {
                name: String::new(),
                identity: [0; 32],
                who: "".into(),
                threads: setting.threads_each,
                memory_bytes: 1 << 40,
            },
        ),
        block_s: setting.blocks_held.then_some(0.0),
        tree_s: None,
    });
    let mut replay = Replay {
        recorded,
        setting,
        workers: workers.collect(),
        threads: (0..setting.workers * setting.threads_each)
            .map(|t| Thread {
                worker: (t % setting.workers) as usize,
                ..Thread::default()
            })
            .collect(),
        scheduler,
        clock: Clock::default(),
        blocks_out: Line::default(),
        rows_in: Line::default(),
        master: Line::default(),
        joining: BTreeMap::new(),
        left: recorded.jobs.len(),
        wall_s: 0.0,
    };
    for job in &recorded.jobs {
        replay.joining.entry(job.batch).or_default().0 += 1;
    }
    for thread in 0..replay.threads.len() {
        replay.clock.at(0.0, What::Ask(thread));
    }
    while let Some((now_s, what)) = replay.clock.next() {
        replay.step(now_s, what);
    }
    let threads = f64::from(setting.workers * setting.threads_each);
    Run {
        wall_s: replay.wall_s,
        efficiency: recorded.jobs_s() / (replay.wall_s * threads),
    }
}

struct Replay<'a> {
    recorded: &'a Recorded,
    setting: Setting,
    scheduler: Scheduler,
    workers: Vec<Worker>,
    threads: Vec<Thread>,
    clock: Clock,
    blocks_out: Line,
    rows_in: Line,
    /// The master's threads, all at one thing.
    master: Line,
    /// By batch: jobs that are not in, and entries of those that are.
    joining: BTreeMap<u32, (usize, u64)>,
    left: usize,
    wall_s: f64,
}

impl Replay<'_> {
    fn step(&mut self, now_s: f64, what: What) {
        let now = Duration::from_secs_f64(now_s);
        match what {
            What::Ask(t) => {
                let worker = self.threads[t].worker;
                let id = self.workers[worker].id;
                let _ = self.scheduler.renew(now, id, &[]);
                let Ok(Some(leased)) = self.scheduler.lease(now, id, &[[1; 32]]) else {
                    // the master looks for stragglers that often
                    if self.left > 0 {
                        self.clock.at(now_s + 0.1, What::Ask(t));
                    }
                    return;
                };
                let job = self.recorded.jobs[leased.job];
                let begins_s = self.ready_s(worker, now_s + self.setting.latency_s, job.rays);
                self.threads[t].computing = Some(leased);
                self.clock.at(begins_s + job.took_s, What::Computed(t));
            }
            What::Computed(t) => {
                self.threads[t].waits = true;
                self.send(t, now_s);
            }
            What::Came(t) => {
                let leased = self.threads[t].returning;
                let entries = leased.map_or(0, |l| self.recorded.jobs[l.job].entries);
                let takes_s = self.recorded.check_s * entries as f64;
                let done_s = self.work(now_s, takes_s);
                self.clock.at(done_s, What::Checked(t));
            }
            What::Checked(t) => {
                if let Some(leased) = self.threads[t].returning.take() {
                    let job = self.recorded.jobs[leased.job];
                    let id = self.workers[self.threads[t].worker].id;
                    let used = self.scheduler.finish(now, id, leased.lease, job.took_s);
                    if used.is_some() {
                        self.left -= 1;
                        self.put(now_s, job.batch, job.entries);
                    }
                }
                self.send(t, now_s);
            }
        }
    }

    /// When a worker can begin that may begin at `at_s`.
    fn ready_s(&mut self, worker: usize, at_s: f64, rays: bool) -> f64 {
        let of = &mut self.workers[worker];
        let takes_s = self.recorded.block_bytes as f64 / self.setting.bytes_per_s;
        let block_s = *of
            .block_s
            .get_or_insert_with(|| self.blocks_out.do_for(at_s, takes_s) + self.recorded.ready_s);
        let ready_s = at_s.max(block_s);
        if !rays {
            return ready_s;
        }
        let tree_s = *of.tree_s.get_or_insert(ready_s + self.recorded.tree_s);
        ready_s.max(tree_s)
    }

    /// Sends the result that is ready, unless one is on its way; and asks for the next job.
    fn send(&mut self, t: usize, now_s: f64) {
        let thread = &mut self.threads[t];
        if !thread.waits || thread.returning.is_some() {
            return;
        }
        thread.waits = false;
        thread.returning = thread.computing.take();
        if let Some(leased) = thread.returning {
            let bytes = self.recorded.jobs[leased.job].bytes as f64;
            let takes_s = bytes / self.setting.bytes_per_s;
            let through_s = self.rows_in.do_for(now_s + self.setting.latency_s, takes_s);
            self.clock.at(through_s, What::Came(t));
        }
        self.clock.at(now_s, What::Ask(t));
    }

    /// A job's result is in; with the last one of its batch that is joined.
    fn put(&mut self, now_s: f64, batch: u32, entries: u64) {
        let (left, all) = self.joining.entry(batch).or_default();
        *left -= 1;
        *all += entries;
        if *left == 0 {
            let takes_s = self.recorded.join_s * *all as f64;
            self.wall_s = self.work(now_s, takes_s).max(self.wall_s);
        }
    }

    /// When the master is done with something that takes one thread so long.
    fn work(&mut self, now_s: f64, takes_s: f64) -> f64 {
        let threads = f64::from(self.setting.master_threads);
        self.master.do_for(now_s, takes_s / threads)
    }
}
