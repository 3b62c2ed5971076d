//! Connections of the master: their number is bounded, what goes over them is counted, and those that
//! are silent are closed.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use prometheus_client::metrics::counter::Counter;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};
use tokio::time::{Instant, Sleep};
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::server::{Connected, TcpConnectInfo};

use super::metrics::{Metrics, OfDirection};

/// Connections at a time; more wait until one is closed.
const MAX_CONNECTIONS: usize = 4096;

/// A connection on which nothing comes for so long is closed. Whoever speaks HTTP/2 answers the pings
/// that keep it alive, and so is never silent for a third of this.
const SILENCE: Duration = Duration::from_secs(120);

/// A connection that counts its bytes.
#[derive(Debug)]
pub(super) struct Connection {
    stream: TcpStream,
    /// When the last bytes came, and when to look again.
    heard: Instant,
    look: Pin<Box<Sleep>>,
    received: Counter,
    sent: Counter,
    metrics: Arc<Metrics>,
    _permit: OwnedSemaphorePermit,
}

/// All connections that come in, until the receiver goes.
pub(super) fn incoming(
    listener: TcpListener,
    metrics: Arc<Metrics>,
) -> ReceiverStream<io::Result<Connection>> {
    let (connections, receiver) = mpsc::channel(1);
    let permits = Arc::new(Semaphore::new(MAX_CONNECTIONS));
    tokio::spawn(async move {
        let count = |direction| {
            let of = OfDirection { direction };
            metrics.network_bytes.get_or_create(&of).clone()
        };
        let (received, sent) = (count("received"), count("sent"));
        while let Ok(permit) = permits.clone().acquire_owned().await {
            let stream = tokio::select! {
                accepted = listener.accept() => accepted,
                () = connections.closed() => return,
            };
            let stream = match stream {
                Ok((stream, _)) => stream,
                Err(error) => {
                    // of that connection, or of all for lack of files: neither ends the master
                    tracing::warn!(%error, "no connection");
                    tokio::time::sleep(Duration::from_millis(50)).await;
                    continue;
                }
            };
            // only a matter of speed
            let _ = stream.set_nodelay(true);
            metrics.connections.inc();
            let connection = Connection {
                stream,
                heard: Instant::now(),
                look: Box::pin(tokio::time::sleep(SILENCE)),
                received: received.clone(),
                sent: sent.clone(),
                metrics: metrics.clone(),
                _permit: permit,
            };
            if connections.send(Ok(connection)).await.is_err() {
                return;
            }
        }
    });
    ReceiverStream::new(receiver)
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.metrics.connections.dec();
    }
}

impl Connected for Connection {
    type ConnectInfo = TcpConnectInfo;

    fn connect_info(&self) -> TcpConnectInfo {
        self.stream.connect_info()
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = into.filled().len();
        match Pin::new(&mut self.stream).poll_read(context, into) {
            Poll::Ready(outcome) => {
                outcome?;
                self.heard = Instant::now();
                self.received.inc_by((into.filled().len() - before) as u64);
                Poll::Ready(Ok(()))
            }
            Poll::Pending => {
                // the timer is set anew when it goes off, not with every byte
                while self.look.as_mut().poll(context).is_ready() {
                    let end = self.heard + SILENCE;
                    if end <= Instant::now() {
                        return Poll::Ready(Err(io::ErrorKind::TimedOut.into()));
                    }
                    self.look.as_mut().reset(end);
                }
                Poll::Pending
            }
        }
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        from: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = ready!(Pin::new(&mut self.stream).poll_write(context, from))?;
        self.sent.inc_by(written as u64);
        Poll::Ready(Ok(written))
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        from: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = ready!(Pin::new(&mut self.stream).poll_write_vectored(context, from))?;
        self.sent.inc_by(written as u64);
        Poll::Ready(Ok(written))
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

#[cfg(test)]
mod tests {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    use tokio_stream::StreamExt;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_connection_is_counted_and_closed_when_it_is_silent() {
        let metrics = Arc::new(Metrics::default());
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let mut connections = incoming(listener, metrics.clone());
        let mut peer = TcpStream::connect(address).await.unwrap();
        let mut connection = connections.next().await.unwrap().unwrap();
        peer.write_all(b"hello").await.unwrap();
        let mut bytes = [0; 5];
        connection.read_exact(&mut bytes).await.unwrap();
        assert_eq!(connection.received.get(), 5);
        let begun = Instant::now();
        let error = connection.read_u8().await.unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert!(begun.elapsed() >= SILENCE - Duration::from_secs(1));
        assert_eq!(metrics.connections.get(), 1);
        drop(connection);
        assert_eq!(metrics.connections.get(), 0);
    }
}
