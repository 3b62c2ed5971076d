//! Room for results that are on their way in, and the pace at which they have to come.
//!
//! Bytes are let in up to a limit, large results apart from others: who promises a lot holds up nobody but those who do
//! the same. A result that crawls is given up; where others wait for its room, so is one that is merely slow.

use std::future::Future;
use std::pin::pin;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use tokio::sync::{Semaphore, SemaphorePermit};
use tokio::time::{Instant, timeout};
use tonic::Status;

/// A result that takes more than this part of the room is a large one.
const PART_OF_LARGE: u64 = 16;

/// A result that comes more slowly than this is given up, bytes a second.
const SLOWEST: u64 = 4 << 10;

/// Where others wait for room, a result has to come in at a pace at which the whole takes no longer than this.
const WITHIN: Duration = Duration::from_secs(60);

/// For so long, a pace cannot be told.
const MOMENT: Duration = Duration::from_secs(2);

/// How often it is looked.
const LOOK: Duration = Duration::from_millis(250);

/// Room for results on their way in.
pub(crate) struct Room {
    bytes: u64,
    large: Lane,
    other: Lane,
}

struct Lane {
    /// Kibibytes that may come in now.
    free: Semaphore,
    /// Results that wait for that.
    waiting: AtomicUsize,
}

impl Lane {
    fn new(bytes: u64) -> Self {
        Self {
            free: Semaphore::new(kibibytes(bytes) as usize),
            waiting: AtomicUsize::new(0),
        }
    }
}

/// Counts one who waits, until it is dropped.
struct Waiting<'a>(&'a AtomicUsize);

impl<'a> Waiting<'a> {
    fn begin(count: &'a AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(count)
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Room {
    /// For so many bytes: half of them for large results.
    pub(crate) fn new(bytes: u64) -> Self {
        Self {
            bytes,
            large: Lane::new(bytes / 2),
            other: Lane::new(bytes / 2),
        }
    }

    /// No result is larger than this.
    pub(crate) fn most_bytes(&self) -> u64 {
        self.bytes / 2
    }

    /// Lets a result in, once there is room for it.
    pub(crate) async fn enter(&self, bytes: u64) -> Result<Coming<'_>, Status> {
        let is_large = bytes > self.bytes / PART_OF_LARGE;
        let lane = if is_large { &self.large } else { &self.other };
        let waiting = Waiting::begin(&lane.waiting);
        let permit = lane.free.acquire_many(kibibytes(bytes)).await;
        drop(waiting);
        Ok(Coming {
            lane,
            _permit: permit.map_err(|_| Status::cancelled("master ends"))?,
            promised: bytes,
            begun: Instant::now(),
            came: 0,
            pressed: None,
        })
    }
}

/// A result on its way in.
pub(crate) struct Coming<'a> {
    lane: &'a Lane,
    _permit: SemaphorePermit<'a>,
    promised: u64,
    begun: Instant,
    came: u64,
    /// Since when others wait for the room, and what had come by then.
    pressed: Option<(Instant, u64)>,
}

impl Coming<'_> {
    /// So many bytes more have come.
    pub(crate) fn came(&mut self, bytes: usize) {
        self.came += bytes as u64;
    }

    /// Waits for the next part, for as long as the result comes fast enough; `patience` is how long nothing at all may
    /// come.
    pub(crate) async fn wait<T>(
        &mut self,
        part: impl Future<Output = T>,
        patience: Duration,
    ) -> Result<T, Status> {
        let mut part = pin!(part);
        loop {
            self.check(patience)?;
            if let Ok(part) = timeout(LOOK, &mut part).await {
                return Ok(part);
            }
        }
    }

    fn check(&mut self, patience: Duration) -> Result<(), Status> {
        let now = Instant::now();
        let earned = Duration::from_secs_f64(self.came as f64 / SLOWEST as f64);
        let crawls = now - self.begun > patience + earned;
        let is_wanted = self.lane.waiting.load(Ordering::Relaxed) > 0;
        let (since, before) = *self.pressed.get_or_insert((now, self.came));
        if !is_wanted {
            self.pressed = None;
        }
        let pressed = now - since;
        // parts that come in a moment are not there yet
        let counted = pressed.saturating_sub(MOMENT);
        let needed = self.promised as f64 * counted.as_secs_f64() / WITHIN.as_secs_f64();
        let holds_up = is_wanted && ((self.came - before) as f64) < needed;
        if crawls || holds_up {
            let (came, promised) = (self.came, self.promised);
            let taken_s = (now - self.begun).as_secs_f64();
            let text =
                format!("result comes too slowly: {came} of {promised} bytes in {taken_s:.1} s");
            return Err(Status::deadline_exceeded(text));
        }
        Ok(())
    }
}

fn kibibytes(bytes: u64) -> u32 {
    u32::try_from(bytes.div_ceil(1 << 10)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use std::future::pending;

    use tokio::time::sleep;
    use tonic::Code;

    use super::*;

    const GIB: u64 = 1 << 30;
    const LEASE: Duration = Duration::from_secs(30);

    /// Brings a result byte by byte, each after a pause; how long it was borne with.
    async fn drip(room: &Room, bytes: u64, pause: Duration) -> Duration {
        let mut coming = room.enter(bytes).await.unwrap();
        let begun = Instant::now();
        loop {
            match coming.wait(sleep(pause), LEASE).await {
                Ok(()) => coming.came(1),
                Err(status) => {
                    assert_eq!(status.code(), Code::DeadlineExceeded);
                    return begun.elapsed();
                }
            }
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_result_that_crawls_is_given_up_after_the_lease_time() {
        let room = Room::new(GIB);
        let borne = drip(&room, GIB / 2, Duration::from_secs(2)).await;
        assert!((LEASE..LEASE + MOMENT).contains(&borne), "{borne:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_large_promise_holds_up_no_other_result() {
        let room = Room::new(GIB);
        let _large = room.enter(GIB / 2).await.unwrap();
        let begun = Instant::now();
        let _small = room.enter(GIB / 16).await.unwrap();
        assert_eq!(begun.elapsed(), Duration::ZERO);
    }

    #[tokio::test(start_paused = true)]
    async fn a_slow_result_makes_room_for_one_that_waits() {
        let room = Room::new(GIB);
        let slow = async {
            let all = (0..8).map(|_| drip(&room, GIB / 16, Duration::from_secs(2)));
            let mut all: Vec<_> = all.map(Box::pin).collect();
            for one in &mut all {
                // all of them have the room by then
                let _ = timeout(Duration::from_millis(1), one).await;
            }
            for one in all {
                one.await;
            }
        };
        let waits = async {
            sleep(Duration::from_millis(100)).await;
            let begun = Instant::now();
            let _room = room.enter(GIB / 16).await.unwrap();
            begun.elapsed()
        };
        let (_, waited) = tokio::join!(slow, waits);
        assert!(waited < 3 * MOMENT, "{waited:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn a_result_at_a_fair_pace_comes_in_while_others_wait() {
        let room = Room::new(GIB);
        let mut coming = room.enter(GIB / 2).await.unwrap();
        let fair = async {
            let second = Duration::from_secs(1);
            for _ in 0..50 {
                coming.wait(sleep(second), LEASE).await.unwrap();
                coming.came((GIB / 100) as usize);
            }
            drop(coming);
        };
        let waits = async { room.enter(GIB / 2).await.map(drop) };
        let ((), waited) = tokio::join!(fair, waits);
        assert!(waited.is_ok());
    }

    #[tokio::test(start_paused = true)]
    async fn nothing_at_all_is_waited_for_no_longer_than_the_lease_time() {
        let room = Room::new(GIB);
        let mut coming = room.enter(1000).await.unwrap();
        let begun = Instant::now();
        assert!(coming.wait(pending::<()>(), LEASE).await.is_err());
        assert!(begun.elapsed() < LEASE + 2 * LOOK);
    }
}
