//! Scenes that are on their way: how many at a time, and how long one may take.

use std::collections::HashMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use tokio::sync::{AcquireError, OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, timeout};

use super::caller::Caller;
use super::error::{ErrorCode, ServiceError};

/// Scenes that are taken in at a time: each may hold a message or two that is not checked yet.
const UPLOADS: usize = 16;

/// Of one client.
const UPLOADS_OF_ONE: usize = UPLOADS / 2;

/// A client that brings nothing for so long in the middle of a scene is given up.
const SILENCE: Duration = Duration::from_secs(60);

/// ... where others wait for its place.
const SILENCE_BEFORE_OTHERS: Duration = Duration::from_secs(10);

/// Less than this in that time is nothing, bytes.
const SOMETHING: u64 = 256 << 10;

/// Who was refused a place may ask again after this.
const AGAIN: Duration = Duration::from_secs(5);

/// Places for uploads.
#[derive(Debug)]
pub(super) struct Uploads {
    all: Arc<Places>,
    /// Of every client that has or wants a place.
    own: Mutex<HashMap<Caller, Weak<Places>>>,
}

#[derive(Debug)]
struct Places {
    free: Arc<Semaphore>,
    wanted: AtomicUsize,
}

/// The place of one upload.
#[derive(Debug)]
pub(super) struct Place {
    all: Arc<Places>,
    own: Arc<Places>,
    _permits: [OwnedSemaphorePermit; 2],
}

impl Uploads {
    pub(super) fn new() -> Self {
        Self {
            all: Places::new(UPLOADS),
            own: Mutex::default(),
        }
    }

    /// A place for an upload; waits for it.
    pub(super) async fn place(&self, caller: Caller) -> Result<Place, ServiceError> {
        let (all, own) = (self.all.clone(), self.own(caller));
        let both = async {
            // one's own first: who waits for that keeps no place from others
            let permits = [own.permit().await?, all.permit().await?];
            Ok::<_, AcquireError>(permits)
        };
        let busy = || {
            let message = format!(
                "{UPLOADS} scenes are uploaded at a time, {UPLOADS_OF_ONE} of one client, and none came to its end"
            );
            ServiceError::new(ErrorCode::Exhausted, message).again_after(AGAIN)
        };
        match timeout(SILENCE, both).await {
            Ok(Ok(permits)) => Ok(Place {
                all,
                own,
                _permits: permits,
            }),
            _ => Err(busy()),
        }
    }

    fn own(&self, caller: Caller) -> Arc<Places> {
        // the map is whole at any time, even if a thread died with the lock
        let mut own = self.own.lock().unwrap_or_else(PoisonError::into_inner);
        own.retain(|_, places| places.strong_count() > 0);
        own.get(&caller).and_then(Weak::upgrade).unwrap_or_else(|| {
            let places = Places::new(UPLOADS_OF_ONE);
            own.insert(caller, Arc::downgrade(&places));
            places
        })
    }
}

impl Places {
    fn new(count: usize) -> Arc<Self> {
        Arc::new(Self {
            free: Arc::new(Semaphore::new(count)),
            wanted: AtomicUsize::new(0),
        })
    }

    async fn permit(&self) -> Result<OwnedSemaphorePermit, AcquireError> {
        let _waiting = Waiting::new(&self.wanted);
        self.free.clone().acquire_owned().await
    }

    fn is_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed) > 0
    }
}

/// Counts one who waits, until it has what it waits for, or is gone.
struct Waiting<'a>(&'a AtomicUsize);

impl<'a> Waiting<'a> {
    fn new(count: &'a AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::Relaxed);
        Self(count)
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// How fast an upload goes on.
#[derive(Debug)]
pub(super) struct Pace {
    place: Place,
    /// When it last had brought something, and what came since.
    since: Instant,
    bytes: u64,
}

impl Pace {
    pub(super) fn begin(place: Place) -> Self {
        Self {
            place,
            since: Instant::now(),
            bytes: 0,
        }
    }

    /// So much has come. Slices without content bring nothing.
    pub(super) fn arrived(&mut self, bytes: u64) {
        self.bytes += bytes;
        if self.bytes >= SOMETHING {
            (self.since, self.bytes) = (Instant::now(), 0);
        }
    }

    /// Refuses an upload that does not go on.
    pub(super) fn check(&self) -> Result<(), ServiceError> {
        let silent = self.since.elapsed();
        let expected = |within: Duration, more: &str| {
            let (least, seconds) = (SOMETHING >> 10, within.as_secs());
            format!("the scene: expected {least} KiB more, or its end, within {seconds} s{more}")
        };
        if silent > SILENCE {
            let message = expected(SILENCE, "");
            return Err(ServiceError::new(ErrorCode::TooLate, message));
        }
        if silent > SILENCE_BEFORE_OTHERS
            && (self.place.all.is_wanted() || self.place.own.is_wanted())
        {
            let message = expected(SILENCE_BEFORE_OTHERS, ", because others wait");
            let error = ServiceError::new(ErrorCode::Exhausted, message);
            return Err(error.again_after(AGAIN));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn caller(number: u8) -> Caller {
        Caller::number(number)
    }

    #[tokio::test(start_paused = true)]
    async fn one_client_never_has_all_places() {
        let uploads = Uploads::new();
        let mut held = Vec::new();
        for _ in 0..UPLOADS_OF_ONE {
            held.push(uploads.place(caller(1)).await.unwrap());
        }
        let begun = Instant::now();
        let refused = uploads.place(caller(1)).await.unwrap_err();
        assert_eq!(refused.code, ErrorCode::Exhausted);
        assert!(refused.message.contains("try again in 5 s"), "{refused}");
        assert!(begun.elapsed() >= SILENCE);
        let begun = Instant::now();
        let _other = uploads.place(caller(2)).await.unwrap();
        assert_eq!(begun.elapsed(), Duration::ZERO);
        held.pop();
        assert!(uploads.place(caller(1)).await.is_ok());
    }

    #[tokio::test(start_paused = true)]
    async fn an_upload_that_brings_nothing_makes_room() {
        let uploads = Arc::new(Uploads::new());
        let mut paces = Vec::new();
        for k in 0..UPLOADS {
            let place = uploads.place(caller(k as u8 / 8)).await.unwrap();
            paces.push(Pace::begin(place));
        }
        tokio::time::sleep(Duration::from_secs(11)).await;
        // slices without content, and with little
        paces[0].arrived(0);
        paces[1].arrived(SOMETHING);
        assert!(paces.iter().all(|pace| pace.check().is_ok()));
        let also = uploads.clone();
        let waiting = tokio::spawn(async move { also.place(caller(9)).await.is_ok() });
        tokio::task::yield_now().await;
        let ends = paces.iter().map(|pace| pace.check().is_err());
        let ends: Vec<bool> = ends.collect();
        assert!(ends[0] && !ends[1] && ends[2..].iter().all(|&ends| ends));
        let refused = paces[0].check().unwrap_err();
        assert_eq!(refused.code, ErrorCode::Exhausted);
        paces.remove(0);
        assert!(waiting.await.unwrap());
        // nobody waits any more
        assert!(paces.iter().all(|pace| pace.check().is_ok()));
        tokio::time::sleep(SILENCE).await;
        let refused = paces[1].check().unwrap_err();
        assert_eq!(refused.code, ErrorCode::TooLate);
    }
}
