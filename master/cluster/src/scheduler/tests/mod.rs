mod any_order;

use std::time::Duration;

use super::*;

fn at(seconds: f64) -> Time {
    Duration::from_secs_f64(seconds)
}

fn facts(name: &str, threads: u32) -> WorkerFacts {
    WorkerFacts {
        name: name.to_owned(),
        identity: *blake3::hash(name.as_bytes()).as_bytes(),
        who: name.into(),
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
    assert_eq!(lease(&mut s, 29.0, b), None);
    s.expire(at(40.0));
    s.expire(at(50.0));
    let second = lease(&mut s, 50.0, b).unwrap();
    assert_eq!(second.job, first.job);
    assert!(s.finish(at(51.0), a, first.lease, 1.0).is_some());
    assert_eq!(s.counts(solve).unwrap().done, 1);
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
    // two are enough, for a while
    assert_eq!(lease(&mut s, 5.9, workers[2]), None);
    assert_eq!(lease(&mut s, 6.1, workers[1]), None);
    assert_eq!(lease(&mut s, 6.1, workers[2]).unwrap().job, slow.job);
    assert!(s.finish(at(2.0), workers[1], again.lease, 0.5).is_some());
    assert_eq!(s.wanted(at(2.0), workers[0], slow.lease), Ok(None));
}

#[test]
fn a_worker_that_fails_a_job_twice_does_not_get_it_a_third_time() {
    let mut s = scheduler();
    let a = s.join(at(0.0), facts("a", 1));
    let solve = begin(&mut s, &[2.0, 1.0]);
    let fail = |s: &mut Scheduler, worker, reason| {
        let held = lease(s, 0.0, worker).unwrap();
        s.give_back(at(0.0), worker, held.lease, Some(reason))
            .unwrap();
        held.job
    };
    assert_eq!(fail(&mut s, a, "no memory"), 0);
    // not under another number either
    s.leave(at(0.0), a);
    let a = s.join(at(0.0), facts("a", 1));
    assert_eq!(fail(&mut s, a, "no memory"), 0);
    assert_eq!(lease(&mut s, 0.0, a).unwrap().job, 1);
    assert_eq!(s.failing(solve), Some((0, "worker 'a': no memory")));
    let b = s.join(at(0.0), facts("b", 1));
    assert_eq!(s.failing(solve), None, "another worker can do it");
    for _ in 0..2 {
        assert_eq!(fail(&mut s, b, "disk on fire"), 0);
    }
    assert_eq!(s.failing(solve), Some((0, "worker 'b': disk on fire")));
    assert!(s.known(solve, 0));
    assert_eq!(s.failing(solve), None);
}

#[test]
fn a_job_that_several_workers_do_not_survive_is_one_for_the_master_too() {
    let mut s = scheduler();
    let solve = begin(&mut s, &[1.0]);
    for k in 0..3 {
        assert_eq!(s.failing(solve), None, "after {k}");
        let start = f64::from(k) * 100.0;
        let worker = s.join(at(start), facts(&format!("victim {k}"), 1));
        lease(&mut s, start, worker).unwrap();
        s.expire(at(start + 30.0));
    }
    let (_, reason) = s.failing(solve).unwrap();
    assert!(
        reason.contains("sent nothing within the lease time"),
        "{reason}"
    );
    // nobody is kept from it
    let other = s.join(at(400.0), facts("other", 1));
    assert!(lease(&mut s, 400.0, other).is_some());
}

#[test]
fn one_worker_that_comes_again_and_again_is_one_worker() {
    let mut s = scheduler();
    let solve = begin(&mut s, &[1.0]);
    let steady = s.join(at(0.0), facts("steady", 1));
    for _ in 0..9 {
        let bad = s.join(at(0.0), facts("bad", 1));
        if let Some(held) = lease(&mut s, 0.0, bad) {
            s.give_back(at(0.0), bad, held.lease, Some("no")).unwrap();
        }
        s.leave(at(0.0), bad);
    }
    assert_eq!(s.failing(solve), None);
    assert!(lease(&mut s, 0.0, steady).is_some());
}

#[test]
fn a_time_that_was_made_up_does_not_keep_jobs_from_others() {
    let mut s = scheduler();
    let (rogue, good) = (
        s.join(at(0.0), facts("rogue", 1)),
        s.join(at(0.0), facts("good", 1)),
    );
    let solve = begin(&mut s, &[1.0, 1.0]);
    let first = lease(&mut s, 0.0, rogue).unwrap();
    let held = lease(&mut s, 0.0, rogue).unwrap();
    assert!(s.finish(at(0.5), rogue, first.lease, 1e300).is_some());
    assert!(s.left_s() <= 1.0, "{}", s.left_s());
    assert_eq!(lease(&mut s, 1.6, good).unwrap().job, held.job);
    assert_eq!(s.counts(solve).unwrap().done, 1);
    // nor a time that was long indeed, for longer than a lease
    let mut s = scheduler();
    let (slow, good) = (
        s.join(at(0.0), facts("slow", 1)),
        s.join(at(0.0), facts("good", 1)),
    );
    begin(&mut s, &[1.0, 1.0]);
    let first = lease(&mut s, 0.0, slow).unwrap();
    let held = lease(&mut s, 0.0, slow).unwrap();
    assert!(s.finish(at(1000.0), slow, first.lease, 1e300).is_some());
    assert_eq!(lease(&mut s, 1000.0, good).unwrap().job, held.job);
}

#[test]
fn many_threads_are_believed_when_they_have_computed_something() {
    let mut s = scheduler();
    let boaster = s.join(at(0.0), facts("boaster", 4096));
    begin(&mut s, &[1.0; 200]);
    let held: Vec<Leased> = std::iter::from_fn(|| lease(&mut s, 0.0, boaster)).collect();
    assert_eq!(held.len(), 64);
    for done in &held[..10] {
        s.finish(at(1.0), boaster, done.lease, 1.0).unwrap();
    }
    let more = std::iter::from_fn(|| lease(&mut s, 1.0, boaster)).count();
    assert_eq!(more, 10 + 2 * 10);
}

#[test]
fn a_worker_that_is_too_small_is_told_once_and_shown() {
    let mut s = scheduler();
    let small = WorkerFacts {
        memory_bytes: 1 << 20,
        ..facts("small", 1)
    };
    let small = s.join(at(0.0), small);
    assert_eq!(s.tell_too_small(small), None, "there is nothing to do");
    let solve = begin(&mut s, &[1.0]);
    let needs = nestrad_kernel::BASE_BYTES;
    assert_eq!(s.tell_too_small(small), Some((needs, true)));
    assert_eq!(s.tell_too_small(small), Some((needs, false)));
    assert_eq!(s.workers(at(0.0))[0].too_small_for, Some(needs));
    assert!(!s.has_worker_for(solve));
    s.end(solve);
    assert_eq!(s.workers(at(0.0))[0].too_small_for, None);
}

#[test]
fn how_long_nobody_has_been_there_is_known() {
    let mut s = scheduler();
    assert_eq!(s.deserted_for(at(5.0)), Some(at(5.0)));
    let a = s.join(at(6.0), facts("a", 1));
    assert_eq!(s.deserted_for(at(7.0)), None);
    s.leave(at(8.0), a);
    assert_eq!(s.deserted_for(at(10.0)), Some(at(2.0)));
}

#[test]
fn the_master_gets_what_waits_and_then_what_others_have_for_long() {
    let mut s = scheduler();
    let a = s.join(at(0.0), facts("a", 1));
    let solve = begin(&mut s, &[1.0, 1.0, 1.0]);
    let held = [0.0, 3.0].map(|now| lease(&mut s, now, a).unwrap());
    assert_eq!(s.for_the_master(at(3.5), solve, 9), [2]);
    s.known(solve, 2);
    assert_eq!(s.for_the_master(at(3.5), solve, 9), [held[0].job]);
    assert!(s.known(solve, held[0].job));
    let unwanted = s.renew(at(3.6), a, &[held[0].lease, held[1].lease]);
    assert_eq!(unwanted, Ok(vec![held[0].lease]));
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
