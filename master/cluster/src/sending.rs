//! Blocks on their way to workers, a few at a time.
//!
//! Many workers may come at once, and each needs its block before it can begin. Sent to all of them together, all
//! would have it when the last one has; sent to a few after a few, they wait half as long on average.

use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use nestrad_proto::SLICE_BYTES;
use nestrad_proto::v1::{FetchBlockResponse, fetch_block_response};
use tokio::sync::{Semaphore, oneshot};
use tokio::time::timeout;
use tokio_stream::{Stream, StreamExt};
use tonic::Status;

/// Workers to which blocks go out at a time: enough to fill a link in spite of the way there and back.
const AT_A_TIME: usize = 8;

/// Who takes longer than this holds up the others no more.
const TURN: Duration = Duration::from_millis(500);

/// A block as workers get it.
pub(crate) type Sending = Pin<Box<dyn Stream<Item = Result<FetchBlockResponse, Status>> + Send>>;

/// Who may be sent a block now.
pub(crate) struct Turns(Arc<Semaphore>);

impl Turns {
    pub(crate) fn new() -> Self {
        Self(Arc::new(Semaphore::new(AT_A_TIME)))
    }

    /// Sends a block when its turn has come.
    pub(crate) async fn send(&self, block: Bytes) -> Sending {
        let turn = self.0.clone().acquire_owned().await;
        // dropped with the stream
        let (sends, sent) = oneshot::channel::<()>();
        tokio::spawn(async move {
            let _ = timeout(TURN, sent).await;
            drop(turn);
        });
        let total = fetch_block_response::Part::TotalBytes(block.len() as u64);
        let chunks: Vec<Bytes> = (0..block.len())
            .step_by(SLICE_BYTES)
            .map(|at| block.slice(at..(at + SLICE_BYTES).min(block.len())))
            .collect();
        let chunks = chunks.into_iter().map(fetch_block_response::Part::Chunk);
        let messages = std::iter::once(total).chain(chunks);
        Box::pin(tokio_stream::iter(messages).map(move |part| {
            let _until_the_last = &sends;
            Ok(FetchBlockResponse { part: Some(part) })
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test(start_paused = true)]
    async fn who_does_not_read_holds_up_the_others_for_a_turn_only() {
        let turns = Turns::new();
        let block = Bytes::from(vec![7; SLICE_BYTES + 1]);
        let mut idle = Vec::new();
        for _ in 0..AT_A_TIME {
            idle.push(turns.send(block.clone()).await);
        }
        let begun = tokio::time::Instant::now();
        let sent: Vec<_> = turns.send(block.clone()).await.collect().await;
        assert!((TURN..2 * TURN).contains(&begun.elapsed()));
        assert_eq!(sent.len(), 3);
        // that one is through, so the next need not wait
        let begun = tokio::time::Instant::now();
        drop(turns.send(block).await);
        assert!(begun.elapsed() < TURN);
    }
}
