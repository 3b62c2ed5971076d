//! Which solves are taken on: what they will need is there, and a client has no more of it than its share.

use std::collections::HashMap;
use std::fmt::Display;
use std::sync::Arc;
use std::time::Duration;

use super::caller::Caller;
use super::error::{ErrorCode, ServiceError};
use super::identity::Id;
use super::share::Share;
use super::solve::Solve;

/// Solves that wait, run, or have results that are still to be fetched, however small.
const MOST_SOLVES: u64 = 4096;

/// Whoever waits for results to be fetched asks again after this.
const FETCHED: Duration = Duration::from_secs(10);

/// How many solves, and how much of what they need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Solves that wait.
    pub(super) queue: usize,
    /// Results, bytes.
    pub(super) result_bytes: u64,
    /// Scenes of solves that have not ended, bytes.
    pub(super) scene_bytes: u64,
}

/// What a client, or all others, have.
#[derive(Debug, Default)]
struct Load {
    queued: u64,
    solves: u64,
    result_bytes: u64,
    geometries: HashMap<Id, u64>,
}

impl Load {
    fn of<'a>(solves: impl Iterator<Item = &'a Arc<Solve>>) -> Self {
        let mut load = Self::default();
        for solve in solves.filter(|solve| solve.is_awaited()) {
            load.queued += u64::from(solve.is_queued());
            load.solves += 1;
            load.result_bytes += solve.bytes();
            load.geometries.extend(solve.geometry());
        }
        load
    }

    fn scene_bytes(&self) -> u64 {
        self.geometries.values().sum()
    }
}

impl Bounds {
    /// Refuses a solve for which there is no room among those that are known. `turn_s` is about the time until the
    /// next one leaves the queue.
    pub(super) fn check(
        &self,
        known: &[Arc<Solve>],
        wanted: &Solve,
        turn_s: f64,
    ) -> Result<(), ServiceError> {
        if wanted.bytes() > self.result_bytes {
            let message = format!(
                "the results take {} bytes: the master holds {} bytes of results at most",
                wanted.bytes(),
                self.result_bytes
            );
            return Err(ServiceError::new(ErrorCode::Exhausted, message));
        }
        let is_own = |solve: &&Arc<Solve>| solve.caller == wanted.caller;
        let own = Load::of(known.iter().filter(is_own));
        let others = Load::of(known.iter().filter(|solve| !is_own(solve)));
        let share = |limit: u64, of: fn(&Load) -> u64| Share {
            limit,
            own: of(&own),
            others: of(&others),
        };
        let queue = share(self.queue as u64, |load| load.queued);
        if !queue.allows(1) {
            let what = format_args!(
                "{} solves wait already, {} of them yours",
                queue.own + queue.others,
                queue.own
            );
            let again = Duration::from_secs_f64(turn_s.clamp(1.0, 60.0));
            return Err(refused(what, queue.limit, again));
        }
        let solves = share(MOST_SOLVES, |load| load.solves);
        if !solves.allows(1) {
            let what = format_args!(
                "results of {} solves are not fetched, {} of them yours",
                solves.own + solves.others,
                solves.own
            );
            return Err(refused(what, solves.limit, FETCHED));
        }
        let results = share(self.result_bytes, |load| load.result_bytes);
        if !results.allows(wanted.bytes()) {
            let what = format_args!(
                "results that are not fetched take {} bytes, {} of them yours",
                results.own + results.others,
                results.own
            );
            return Err(refused(what, results.limit, FETCHED));
        }
        let scenes = share(self.scene_bytes, Load::scene_bytes);
        let more = wanted
            .geometry()
            .filter(|(id, _)| !own.geometries.contains_key(id));
        if let Some((_, bytes)) = more
            && !scenes.allows(bytes)
        {
            let what = format_args!(
                "scenes of solves that wait take {} bytes, {} of them yours",
                scenes.own + scenes.others,
                scenes.own
            );
            let again = Duration::from_secs_f64(turn_s.clamp(1.0, 60.0));
            return Err(refused(what, scenes.limit, again));
        }
        Ok(())
    }
}

fn refused(what: impl Display, limit: u64, again: Duration) -> ServiceError {
    let message = format!(
        "{what}: the master holds {limit} at most, and one client half of what the others leave"
    );
    ServiceError::new(ErrorCode::Exhausted, message).again_after(again)
}

/// Whose turn it is: the client of which the fewest are computed, and of those the one that was longest without a
/// turn; among its own, the oldest. Gives the number of the solve.
pub(super) fn next(known: &[Arc<Solve>]) -> Option<usize> {
    let turns = Turns::of(known);
    let waiting = known
        .iter()
        .enumerate()
        .filter(|(_, solve)| solve.is_queued());
    // the first of equals
    waiting
        .min_by_key(|(_, solve)| turns.0.get(&solve.caller))
        .map(|(number, _)| number)
}

/// Solves that are likely to come before that one: those that run, and of every client as many as have their turns
/// before it.
pub(super) fn ahead_of(known: &[Arc<Solve>], solve: &Solve) -> usize {
    let turns = Turns::of(known);
    let mut waiting: HashMap<Caller, usize> = HashMap::new();
    let (mut before, mut running) = (0, 0);
    let mut passed = false;
    for other in known.iter().filter(|other| !other.has_ended()) {
        passed |= other.id == solve.id;
        if !other.is_queued() {
            running += 1;
        } else if other.caller != solve.caller {
            *waiting.entry(other.caller).or_default() += 1;
        } else if !passed {
            before += 1;
        }
    }
    let own = turns.0.get(&solve.caller);
    let others = waiting.into_iter().map(|(caller, count)| {
        let first = turns.0.get(&caller) <= own;
        count.min(before + usize::from(first))
    });
    running + before + others.sum::<usize>()
}

/// For every client, what says when its turn comes: smaller is sooner.
struct Turns(HashMap<Caller, (usize, Option<std::time::Instant>)>);

impl Turns {
    fn of(known: &[Arc<Solve>]) -> Self {
        let mut turns: HashMap<Caller, (usize, Option<std::time::Instant>)> = HashMap::new();
        for solve in known {
            let (running, last) = turns.entry(solve.caller).or_default();
            *running += usize::from(!solve.is_queued() && !solve.has_ended());
            *last = (*last).max(solve.begun());
        }
        Self(turns)
    }
}
