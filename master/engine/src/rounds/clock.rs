//! How much time there is, how fast this machine is, and an alarm.

use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::work::Takes;
use crate::lit_canopy::LitCanopy;
use crate::plan::Plan;
use crate::stop::Stop;

/// How much time there is, and how fast this machine is.
pub(super) struct Clock {
    begun: Instant,
    budget_s: f64,
    slower: Slower,
}

/// How many times as long as on the one core that it is reckoned for a part of a round takes here.
#[derive(Clone, Copy)]
struct Slower {
    trace: f64,
    light: f64,
    rest: f64,
}

/// A round is planned to take this part of the time that is left at most: what it takes is not known better.
const SAFE: f64 = 0.85;

/// The first one this part, because this machine is not known yet.
const SAFE_AT_FIRST: f64 = 0.45;

/// Where there is no time for another, a first round is refused that may take so many times as long as it should.
const UNSURE: f64 = 1.5;

/// A first round that is not done gives way to a much quicker one when there is time for that one, within these parts
/// of the budget.
const GIVES_WAY: [f64; 2] = [0.4, 0.8];

/// What the first round may overrun the budget by: parts of it, or seconds where that is more.
const OVERRUN: f64 = 0.08;
const OVERRUN_S: f64 = 0.35;

impl Clock {
    pub(super) fn start(budget_s: f64) -> Self {
        let slower = 1.0 / rayon::current_num_threads() as f64;
        Self {
            begun: Instant::now(),
            budget_s,
            slower: Slower {
                trace: slower,
                light: slower,
                rest: slower,
            },
        }
    }

    fn left_s(&self) -> f64 {
        self.budget_s - self.begun.elapsed().as_secs_f64()
    }

    pub(super) fn is_over(&self) -> bool {
        self.left_s() <= 0.0
    }

    /// What should take so long on one core takes here, s.
    pub(super) fn takes_s(&self, takes: Takes) -> f64 {
        let Slower { trace, light, rest } = self.slower;
        trace * takes.trace_s + light * takes.light_s + rest * takes.rest_s
    }

    /// Whether a plan should be done in time.
    pub(super) fn allows(&self, takes: Takes) -> bool {
        self.takes_s(takes) <= SAFE * self.left_s()
    }

    /// Whether a first plan leaves time for another.
    pub(super) fn allows_first(&self, lit: &LitCanopy, plan: &Plan) -> bool {
        self.takes_s(Takes::of(lit, plan)) <= SAFE_AT_FIRST * self.left_s()
    }

    /// Whether a first plan that cannot be coarser should be done in time.
    pub(super) fn allows_coarsest(&self, lit: &LitCanopy, plan: &Plan) -> bool {
        UNSURE * self.takes_s(Takes::of(lit, plan)) <= self.left_s()
    }

    /// Learns what this machine takes, from a round that should take so long on one core.
    pub(super) fn learn(&mut self, should: Takes, took: Takes) {
        let learnt = |slower: &mut f64, should_s: f64, took_s: f64| {
            if should_s > 0.0 && took_s > 0.0 {
                *slower = took_s / should_s;
            }
        };
        learnt(&mut self.slower.trace, should.trace_s, took.trace_s);
        learnt(&mut self.slower.light, should.light_s, took.light_s);
        learnt(&mut self.slower.rest, should.rest_s, took.rest_s);
    }

    /// Learns from a round that was stopped how slow this machine is at least.
    pub(super) fn learn_at_least(&mut self, should: Takes, took_s: f64) {
        let slower = took_s / self.takes_s(should).max(f64::MIN_POSITIVE);
        let Slower { trace, light, rest } = &mut self.slower;
        for part in [trace, light, rest] {
            *part *= slower.max(1.0);
        }
    }

    /// Stops a round that is not done in time.
    pub(super) fn alarm(&self, until: Until, stop: &Stop) -> Option<Alarm> {
        let end_s = match until {
            Until::GivesWay { to } => {
                let [early, late] = GIVES_WAY.map(|part| part * self.budget_s);
                (self.budget_s - UNSURE * self.takes_s(to)).clamp(early, late)
            }
            Until::End => self.budget_s,
            Until::PastTheEnd => self.budget_s + (OVERRUN * self.budget_s).max(OVERRUN_S),
        };
        let left_s = end_s - self.begun.elapsed().as_secs_f64();
        let left = Duration::try_from_secs_f64(left_s.max(0.0)).ok()?;
        Alarm::in_time(left, stop)
    }
}

/// How long a round may go on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Until {
    /// A quicker one, which takes so long on one core, can still be done.
    GivesWay { to: Takes },
    /// The time that the user allows is over.
    End,
    /// The same and a bit more: without this round there is nothing.
    PastTheEnd,
}

/// Stops some work when its time is up; dropped before that, it does not.
pub(super) struct Alarm {
    off: Option<Sender<()>>,
    waiting: Option<JoinHandle<()>>,
}

impl Alarm {
    fn in_time(left: Duration, stop: &Stop) -> Option<Self> {
        let (off, is_off) = mpsc::channel::<()>();
        let stop = stop.clone();
        let wait = move || {
            if let Err(RecvTimeoutError::Timeout) = is_off.recv_timeout(left) {
                stop.stop();
            }
        };
        // without a thread to spare, time is as it was planned
        let waiting = thread::Builder::new().spawn(wait).ok()?;
        Some(Self {
            off: Some(off),
            waiting: Some(waiting),
        })
    }
}

impl Drop for Alarm {
    fn drop(&mut self) {
        drop(self.off.take());
        if let Some(waiting) = self.waiting.take() {
            // it does not panic
            let _ = waiting.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_alarm_stops_what_is_late_and_nothing_else() {
        let (late, early) = (Stop::default(), Stop::default());
        let alarm = Alarm::in_time(Duration::from_millis(1), &late).unwrap();
        while late.check().is_ok() {
            thread::yield_now();
        }
        drop(alarm);
        drop(Alarm::in_time(Duration::from_secs(3600), &early));
        assert!(early.check().is_ok());
    }
}
