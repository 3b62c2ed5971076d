//! How long a master waits for its workers before it computes by itself.
//!
//! What counts is what workers bring, not that they are there: who only says that it lives, or brings one result a
//! minute, does not keep the master from computing.

use std::time::Duration;

/// A result makes up for so many times what it takes on one thread: several may have waited for the same link, and
/// not every machine is as fast as the one that was planned for.
const MADE_UP: f64 = 8.0;

/// Time that was waited in vain.
#[derive(Debug)]
pub(crate) struct Patience {
    limit: Duration,
    in_vain: Duration,
    is_over: bool,
}

impl Patience {
    pub(crate) fn new(limit: Duration) -> Self {
        Self {
            limit,
            in_vain: Duration::ZERO,
            is_over: false,
        }
    }

    /// Nothing came for so long.
    pub(crate) fn waited(&mut self, time: Duration) {
        self.in_vain = (self.in_vain + time).min(self.limit);
        self.is_over |= self.in_vain == self.limit;
    }

    /// Nothing will come.
    pub(crate) fn ends(&mut self) {
        self.waited(self.limit);
    }

    /// A worker has brought what takes so long on one thread. Whoever has lost patience finds it again when half of
    /// the waiting is made up for.
    pub(crate) fn is_rewarded(&mut self, cost_s: f64) {
        let made_up = Duration::try_from_secs_f64(MADE_UP * cost_s).unwrap_or_default();
        self.in_vain = self.in_vain.saturating_sub(made_up);
        if self.in_vain <= self.limit / 2 {
            self.is_over = false;
        }
    }

    pub(crate) fn is_over(&self) -> bool {
        self.is_over
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    #[test]
    fn a_result_now_and_then_does_not_keep_a_master_waiting() {
        let mut patience = Patience::new(60 * SECOND);
        let mut waited_s = 0;
        while !patience.is_over() {
            // a job of 0.3 s every ten
            patience.waited(10 * SECOND);
            patience.is_rewarded(0.3);
            waited_s += 10;
            assert!(waited_s <= 90);
        }
        for _ in 0..11 {
            patience.is_rewarded(0.3);
        }
        assert!(patience.is_over());
        patience.is_rewarded(0.3);
        patience.is_rewarded(0.3);
        assert!(
            !patience.is_over(),
            "workers that do their share are waited for again"
        );
    }

    #[test]
    fn a_slow_worker_that_goes_on_is_waited_for() {
        let mut patience = Patience::new(60 * SECOND);
        for _ in 0..1000 {
            // at a sixth of the speed that was planned for
            patience.waited(2 * SECOND);
            patience.is_rewarded(0.3);
            assert!(!patience.is_over());
        }
    }

    #[test]
    fn nobody_is_waited_for_who_does_not_come() {
        let mut patience = Patience::new(60 * SECOND);
        patience.ends();
        assert!(patience.is_over());
        patience.is_rewarded(f64::NAN);
        assert!(patience.is_over());
    }
}
