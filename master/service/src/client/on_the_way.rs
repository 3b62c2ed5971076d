//! How long a scene may be on its way to a master that says nothing.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use nestrad_proto::channel::STREAM_WINDOW;
use nestrad_proto::{SLICE_BYTES, v1};
use prost::Message;
use tokio::time::error::Elapsed;
use tokio::time::{Instant, timeout_at};

use super::ANSWER;

/// What has been taken by the network and not by the master yet is no more than this, bytes.
const MOST_UNDER_WAY: u64 = STREAM_WINDOW as u64 + SLICE_BYTES as u64;

/// A master gives up a client that brings less than this in [`SLOWEST_TIME`], bytes.
const SLOWEST_BYTES: u64 = 256 << 10;
const SLOWEST_TIME: Duration = Duration::from_secs(60);

/// How far an upload is.
#[derive(Clone, Debug)]
pub(super) struct OnTheWay(Arc<Mutex<Sent>>);

#[derive(Debug)]
struct Sent {
    /// When the network took the last slice.
    at: Instant,
    bytes: u64,
}

impl OnTheWay {
    /// Nothing has been sent yet.
    pub(super) fn begin() -> Self {
        let at = Instant::now();
        Self(Arc::new(Mutex::new(Sent { at, bytes: 0 })))
    }

    /// The network takes a slice.
    pub(super) fn goes(&self, slice: &v1::SceneSlice) {
        self.change(|sent| {
            sent.at = Instant::now();
            sent.bytes += slice.encoded_len() as u64;
        });
    }

    /// The answer to an upload, if it comes in time: within a minute after what is on its way has arrived, as slowly as
    /// a master lets it.
    pub(super) async fn answer<T>(&self, call: impl Future<Output = T>) -> Result<T, Elapsed> {
        let mut call = std::pin::pin!(call);
        loop {
            let until = self.deadline();
            match timeout_at(until, &mut call).await {
                Err(elapsed) if self.deadline() <= until => return Err(elapsed),
                // slices went meanwhile
                Err(_) => {}
                Ok(answer) => return Ok(answer),
            }
        }
    }

    fn deadline(&self) -> Instant {
        self.change(|sent| {
            let under_way = sent.bytes.min(MOST_UNDER_WAY) as f64;
            sent.at + ANSWER + SLOWEST_TIME.mul_f64(under_way / SLOWEST_BYTES as f64)
        })
    }

    fn change<T>(&self, change: impl FnOnce(&mut Sent) -> T) -> T {
        // it is whole at any time, even if a thread died with the lock
        change(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

#[cfg(test)]
mod tests {
    use std::future::pending;

    use super::*;

    fn slice(vertices: usize) -> v1::SceneSlice {
        let slice = v1::TriangleSlice {
            vertices_m: vec![1.0; 3 * vertices],
            ..v1::TriangleSlice::default()
        };
        v1::SceneSlice {
            part: Some(v1::scene_slice::Part::Triangles(slice)),
        }
    }

    #[tokio::test(start_paused = true)]
    async fn an_upload_without_an_answer_ends() {
        let (way, begun) = (OnTheWay::begin(), Instant::now());
        way.goes(&slice(100));
        assert!(way.answer(pending::<()>()).await.is_err());
        let took = begun.elapsed();
        assert!(took >= ANSWER && took < ANSWER + SLOWEST_TIME, "{took:?}");
    }

    #[tokio::test(start_paused = true)]
    async fn an_upload_that_goes_on_slowly_is_waited_for() {
        let way = OnTheWay::begin();
        let call = async {
            for _ in 0..100 {
                way.goes(&slice(10_000));
                // as slow as a master lets it
                tokio::time::sleep(Duration::from_secs(54)).await;
            }
            "taken"
        };
        assert_eq!(way.answer(call).await.unwrap(), "taken");
    }

    #[tokio::test(start_paused = true)]
    async fn the_last_slices_of_a_large_scene_have_time_to_arrive() {
        let (way, begun) = (OnTheWay::begin(), Instant::now());
        (0..100).for_each(|_| way.goes(&slice(20_000)));
        assert!(way.answer(pending::<()>()).await.is_err());
        assert_eq!(begun.elapsed().as_secs(), 660);
    }
}
