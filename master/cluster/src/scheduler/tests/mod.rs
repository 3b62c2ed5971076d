mod any_order;

use std::time::Duration;

use super::*;

fn at(seconds: f64) -> Time {
    Duration::from_secs_f64(seconds)
}

fn facts(name: &str, threads: u32) -> WorkerFacts {
    WorkerFacts {
        name: name.to_owned(),
        identity: name.into(),
        threads,
        memory_bytes: 1 << 40,
    }
}

fn scheduler() -> Scheduler {
    Scheduler::new(Rules::default(), 1000)
}

fn block(name: u8) -> BlockSpec {
    BlockSpec {
        id: [name; 32],
        demand: nestrad_kernel::Demand::default(),
    }
}

/// A solve of one block whose jobs cost that much.
fn begin(scheduler: &mut Scheduler, costs_s: &[f64]) -> Id {
    let job = |&cost_s: &f64| JobSpec { block: 0, cost_s };
    scheduler.begin(vec![block(1)], costs_s.iter().map(job).collect())
}

fn lease(scheduler: &mut Scheduler, now: f64, worker: Id) -> Option<Leased> {
    scheduler.lease(at(now), worker, &[]).unwrap()
}

#[test]
fn the_largest_job_is_given_out_first() {
    let mut s = scheduler();
    let worker = s.join(at(0.0), facts("a", 4));
    begin(&mut s, &[1.0, 3.0, 2.0, 3.0]);
    let jobs: Vec<usize> = (0..4)
        .map(|_| lease(&mut s, 0.0, worker).unwrap().job)
        .collect();
    assert_eq!(jobs, [1, 3, 2, 0]);
    assert_eq!(lease(&mut s, 0.0, worker), None);
}

#[test]
fn jobs_of_a_block_that_the_worker_holds_come_first() {
    let mut s = scheduler();
    let worker = s.join(at(0.0), facts("a", 4));
    let job = |block, cost_s| JobSpec { block, cost_s };
    let jobs = vec![job(0, 9.0), job(0, 9.0), job(1, 1.0)];
    s.begin(vec![block(1), block(2)], jobs);
    let first = s.lease(at(0.0), worker, &[[2; 32]]).unwrap().unwrap();
    assert_eq!((first.job, first.block), (2, 1));
    let next = s.lease(at(0.0), worker, &[[2; 32]]).unwrap().unwrap();
    assert_eq!(next.block, 0);
}

#[test]
fn workers_spread_over_blocks() {
    let mut s = scheduler();
    let job = |block| JobSpec { block, cost_s: 1.0 };
    s.begin(
        vec![block(1), block(2)],
        vec![job(0), job(0), job(1), job(1)],
    );
    let mut blocks = Vec::new();
    for name in ["a", "b"] {
        let worker = s.join(at(0.0), facts(name, 1));
        blocks.push(lease(&mut s, 0.0, worker).unwrap().block);
    }
    assert_eq!(blocks, [0, 1]);
}

#[test]
fn two_solves_share_the_workers() {
    let mut s = scheduler();
    let worker = s.join(at(0.0), facts("a", 4));
    let first = begin(&mut s, &[1.0; 4]);
    let second = begin(&mut s, &[1.0; 4]);
    let solves: Vec<Id> = (0..4)
        .map(|_| lease(&mut s, 0.0, worker).unwrap().solve)
        .collect();
    assert_eq!(solves, [first, second, first, second]);
}

#[test]
fn a_lease_without_heartbeat_goes_to_another_and_its_late_result_is_welcome() {
    let mut s = scheduler();
    let (a, b) = (
        s.join(at(0.0), facts("a", 1)),
        s.join(at(0.0), facts("b", 1)),
    );
    let solve = begin(&mut s, &[100.0]);
    let first = lease(&mut s, 0.0, a).unwrap();
    assert_eq!(s.renew(at(20.0), a, &[first.lease]), Ok(vec![]));
    s.expire(at(40.0));
    assert_eq!(lease(&mut s, 49.0, b), None);
    s.expire(at(50.0));
    let second = lease(&mut s, 50.0, b).unwrap();
    assert_eq!(second.job, first.job);
    assert!(s.finish(at(51.0), a, first.lease, 1.0).is_some());
    assert_eq!(s.end_of(solve), Some(SolveEnd::Done));
    assert_eq!(
        s.renew(at(51.0), b, &[second.lease]),
        Ok(vec![second.lease])
    );
    assert_eq!(s.finish(at(51.0), b, second.lease, 1.0), None);
    assert_eq!(s.finish(at(51.0), a, first.lease, 1.0), None);
}

#[test]
fn a_straggler_is_given_out_once_more_when_nothing_waits() {
    let mut s = scheduler();
    let workers = [0, 1, 2].map(|k| s.join(at(0.0), facts(&k.to_string(), 1)));
    begin(&mut s, &[1.0, 1.0, 1.0]);
    let slow = lease(&mut s, 0.0, workers[0]).unwrap();
    for _ in 0..2 {
        let quick = lease(&mut s, 0.0, workers[1]).unwrap();
        s.finish(at(1.0), workers[1], quick.lease, 0.75);
    }
    assert_eq!(lease(&mut s, 1.4, workers[1]), None);
    let again = lease(&mut s, 1.6, workers[1]).unwrap();
    assert_eq!(again.job, slow.job);
    // two are enough
    assert_eq!(lease(&mut s, 9.0, workers[2]), None);
    assert!(s.finish(at(2.0), workers[1], again.lease, 0.5).is_some());
    assert_eq!(s.wanted(at(2.0), workers[0], slow.lease), Ok(None));
}

#[test]
fn a_worker_that_fails_a_job_twice_does_not_get_it_a_third_time() {
    let mut s = scheduler();
    let (a, b) = (
        s.join(at(0.0), facts("a", 1)),
        s.join(at(0.0), facts("b", 1)),
    );
    let solve = begin(&mut s, &[2.0, 1.0]);
    for _ in 0..2 {
        let held = lease(&mut s, 0.0, a).unwrap();
        assert_eq!(held.job, 0);
        s.give_back(at(0.0), a, held.lease, Some("no memory"))
            .unwrap();
    }
    assert_eq!(lease(&mut s, 0.0, a).unwrap().job, 1);
    assert_eq!(s.end_of(solve), None);
    let held = lease(&mut s, 0.0, b).unwrap();
    assert_eq!(held.job, 0);
    s.give_back(at(0.0), b, held.lease, None).unwrap();
    for _ in 0..2 {
        let held = lease(&mut s, 0.0, b).unwrap();
        s.give_back(at(0.0), b, held.lease, Some("disk on fire"))
            .unwrap();
    }
    let Some(SolveEnd::Failed(reason)) = s.end_of(solve) else {
        panic!("goes on");
    };
    assert!(
        reason.contains("every worker") && reason.contains("worker 'b': disk on fire"),
        "{reason}"
    );
}

#[test]
fn a_job_that_nobody_survives_fails_the_solve() {
    let mut s = scheduler();
    let solve = begin(&mut s, &[1.0]);
    for k in 0..8 {
        assert_eq!(s.end_of(solve), None, "after {k}");
        let start = f64::from(k) * 100.0;
        let worker = s.join(at(start), facts("victim", 1));
        lease(&mut s, start, worker).unwrap();
        s.expire(at(start + 30.0));
    }
    assert!(matches!(s.end_of(solve), Some(SolveEnd::Failed(r)) if r.contains("8 times")));
}

#[test]
fn silent_workers_are_forgotten_and_strangers_turned_away() {
    let mut s = scheduler();
    let a = s.join(at(0.0), facts("a", 1));
    begin(&mut s, &[1.0]);
    let held = lease(&mut s, 0.0, a).unwrap();
    let b = s.join(at(30.0), facts("b", 1));
    s.expire(at(60.0));
    assert_eq!(
        s.renew(at(60.0), a, &[held.lease]),
        Err(Refusal::UnknownWorker(a))
    );
    assert_eq!(
        s.wanted(at(60.0), a, held.lease),
        Err(Refusal::UnknownWorker(a))
    );
    let own = lease(&mut s, 60.0, b).unwrap();
    assert_eq!(
        s.give_back(at(60.0), b, 5, None),
        Err(Refusal::UnknownLease(5))
    );
    let c = s.join(at(60.0), facts("c", 1));
    assert_eq!(
        s.wanted(at(60.0), c, own.lease),
        Err(Refusal::UnknownLease(own.lease))
    );
    assert_eq!(s.finish(at(60.0), c, own.lease, 1.0), None);
    assert_eq!(s.renew(at(60.0), c, &[own.lease]), Ok(vec![own.lease]));
}

#[test]
fn a_worker_holds_no_more_than_it_computes_and_returns() {
    let mut s = scheduler();
    let a = s.join(at(0.0), facts("a", 1));
    begin(&mut s, &[1.0; 3]);
    lease(&mut s, 0.0, a).unwrap();
    lease(&mut s, 0.0, a).unwrap();
    assert_eq!(s.lease(at(0.0), a, &[]), Err(Refusal::TooMany(2)));
}

#[test]
fn a_worker_without_the_memory_gets_nothing() {
    let mut s = scheduler();
    let mut small = facts("small", 1);
    small.memory_bytes = 1 << 20;
    let small = s.join(at(0.0), small);
    begin(&mut s, &[1.0]);
    assert_eq!(lease(&mut s, 0.0, small), None);
}

#[test]
fn what_was_known_before_is_not_given_out() {
    let mut s = scheduler();
    let a = s.join(at(0.0), facts("a", 1));
    let solve = begin(&mut s, &[2.0, 1.0]);
    s.known(solve, 0);
    assert_eq!(lease(&mut s, 0.0, a).unwrap().job, 1);
    assert_eq!(
        s.counts(solve),
        Some(SolveCounts {
            waiting: 0,
            leased: 1,
            done: 1
        })
    );
}
