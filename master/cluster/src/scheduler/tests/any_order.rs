//! Whatever happens in whatever order, no job is lost.

use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;

/// What may happen, with numbers that choose among what there is.
#[derive(Clone, Debug)]
enum Event {
    Join,
    Leave(usize),
    Lease(usize),
    Finish(usize),
    FinishAgain(usize),
    GiveBack(usize, bool),
    Renew(usize),
    Wait(u8),
    Begin(Vec<u8>),
    End(usize),
}

fn event() -> impl Strategy<Value = Event> {
    let any = any::<usize>;
    prop_oneof![
        2 => Just(Event::Join),
        1 => any().prop_map(Event::Leave),
        8 => any().prop_map(Event::Lease),
        6 => any().prop_map(Event::Finish),
        1 => any().prop_map(Event::FinishAgain),
        1 => (any(), proptest::bool::weighted(0.3)).prop_map(|(k, f)| Event::GiveBack(k, f)),
        3 => any().prop_map(Event::Renew),
        2 => (1u8..20).prop_map(Event::Wait),
        1 => prop::collection::vec(0u8..9, 0..12).prop_map(Event::Begin),
        1 => any().prop_map(Event::End),
    ]
}

/// The scheduler, and what the outside world knows.
struct World {
    s: Scheduler,
    now: f64,
    workers: Vec<Id>,
    held: Vec<(Id, Leased)>,
    used: Vec<(Id, Leased)>,
    /// Results that counted, by solve and job.
    results: BTreeMap<(Id, usize), u32>,
    solves: BTreeMap<Id, usize>,
}

fn pick<T: Copy>(of: &[T], k: usize) -> Option<T> {
    (!of.is_empty()).then(|| of[k % of.len()])
}

impl World {
    fn finish(&mut self, worker: Id, leased: Leased) {
        if let Some(done) = self.s.finish(at(self.now), worker, leased.lease, 1.0) {
            assert_eq!(done, leased);
            *self.results.entry((leased.solve, leased.job)).or_default() += 1;
            self.used.push((worker, leased));
        }
        self.held.retain(|(_, l)| l.lease != leased.lease);
    }

    fn apply(&mut self, event: Event) {
        let now = at(self.now);
        match event {
            Event::Join => self.workers.push(self.s.join(now, facts("w", 2))),
            Event::Leave(k) => {
                if let Some(worker) = pick(&self.workers, k) {
                    self.s.leave(now, worker);
                }
            }
            Event::Lease(k) => {
                if let Some(worker) = pick(&self.workers, k)
                    && let Ok(Some(leased)) = self.s.lease(now, worker, &[])
                {
                    assert!(
                        !self.results.contains_key(&(leased.solve, leased.job)),
                        "a job that is done is given out"
                    );
                    self.held.push((worker, leased));
                }
            }
            Event::Finish(k) => {
                if let Some((worker, leased)) = pick(&self.held, k) {
                    self.finish(worker, leased);
                }
            }
            Event::FinishAgain(k) => {
                if let Some((worker, leased)) = pick(&self.used, k) {
                    assert_eq!(self.s.finish(now, worker, leased.lease, 1.0), None);
                }
            }
            Event::GiveBack(k, failed) => {
                if let Some((worker, leased)) = pick(&self.held, k) {
                    let _ = self
                        .s
                        .give_back(now, worker, leased.lease, failed.then_some("x"));
                    self.held.retain(|(_, l)| l.lease != leased.lease);
                }
            }
            Event::Renew(k) => {
                if let Some(worker) = pick(&self.workers, k) {
                    let leases: Vec<Id> = self
                        .held
                        .iter()
                        .filter(|(w, _)| *w == worker)
                        .map(|(_, l)| l.lease)
                        .collect();
                    if let Ok(unwanted) = self.s.renew(now, worker, &leases) {
                        self.held.retain(|(_, l)| !unwanted.contains(&l.lease));
                    }
                }
            }
            Event::Wait(seconds) => {
                self.now += f64::from(seconds);
                self.s.expire(at(self.now));
            }
            Event::Begin(costs) => {
                let costs_s: Vec<f64> = costs.into_iter().map(f64::from).collect();
                self.solves
                    .insert(begin(&mut self.s, &costs_s), costs_s.len());
            }
            Event::End(k) => {
                let ids: Vec<Id> = self.solves.keys().copied().collect();
                if let Some(solve) = pick(&ids, k) {
                    self.s.end(solve);
                    self.solves.remove(&solve);
                    assert_eq!(self.s.counts(solve), None);
                }
            }
        }
    }

    /// Jobs are neither lost nor done twice.
    fn check(&self) {
        for (&solve, &jobs) in &self.solves {
            let counts = self.s.counts(solve).unwrap();
            assert_eq!(counts.waiting + counts.leased + counts.done, jobs);
            let results = self.results.range((solve, 0)..=(solve, usize::MAX));
            assert_eq!(results.count(), counts.done);
        }
        assert!(self.results.values().all(|&n| n == 1));
    }
}

proptest! {
    #[test]
    fn no_job_is_lost_and_none_counts_twice(events in prop::collection::vec(event(), 0..300)) {
        let mut world = World {
            s: scheduler(),
            now: 0.0,
            workers: Vec::new(),
            held: Vec::new(),
            used: Vec::new(),
            results: BTreeMap::new(),
            solves: BTreeMap::new(),
        };
        for event in events {
            world.apply(event);
            world.check();
        }
        // one good worker brings everything to an end
        world.apply(Event::Begin(vec![3, 1, 2]));
        world.workers = vec![world.s.join(at(world.now), facts("good", 1))];
        for _ in 0..200 {
            world.now += 5.0;
            let now = at(world.now);
            let good = world.workers[0];
            world.s.renew(now, good, &[]).unwrap();
            world.s.expire(now);
            while let Some(leased) = world.s.lease(at(world.now), good, &[]).unwrap() {
                world.finish(good, leased);
            }
            world.check();
        }
        for (&solve, &jobs) in &world.solves {
            prop_assert_eq!(world.s.counts(solve).unwrap().done, jobs, "goes on for ever");
        }
    }
}
