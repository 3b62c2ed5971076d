//! One connection: its bytes are counted, and it ends when its time is over.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::atomic::Ordering;
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt, ReadBuf};
use tokio::net::TcpStream;
use tokio::runtime::Handle;
use tokio::time::{Instant, Sleep, timeout};
use tonic::transport::server::{Connected, TcpConnectInfo};

use super::register::Place;

/// A connection on which nothing comes for so long is closed. Whoever speaks HTTP/2 answers the pings
/// that keep it alive, and so is never silent for a third of this.
const SILENCE: Duration = Duration::from_secs(120);

/// A connection that is refused is read for so long, and so many bytes: otherwise the reason would not arrive.
const LINGER: Duration = Duration::from_secs(1);
const LINGER_BYTES: u64 = 64 << 10;

/// A connection that has a place among others.
#[derive(Debug)]
pub struct Connection {
    /// `None` once it is closed.
    stream: Option<TcpStream>,
    begun: Instant,
    /// When the last bytes came, and when to look again.
    heard: Instant,
    look: Pin<Box<Sleep>>,
    overdue: bool,
    peer: SocketAddr,
    place: Option<Place>,
}

impl Connection {
    pub(super) fn new(stream: TcpStream, place: Place) -> Self {
        let first_call = place.connections().0.limits.first_call;
        Self {
            stream: Some(stream),
            begun: Instant::now(),
            heard: Instant::now(),
            look: Box::pin(tokio::time::sleep(first_call)),
            overdue: false,
            peer: place.address(),
            place: Some(place),
        }
    }

    /// Who is at the other end.
    pub fn peer(&self) -> SocketAddr {
        self.peer
    }

    /// Whether it is to end now; if not, `context` is woken when it is.
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        let Some(place) = &self.place else {
            return Err(io::ErrorKind::NotConnected.into());
        };
        if place.caller().is_hung_up(context) {
            self.overdue = true;
            return Err(io::ErrorKind::ConnectionAborted.into());
        }
        let shared = &place.connections().0;
        let end = |heard: Instant| match place.caller().is_silent() {
            true => self.begun + shared.limits.first_call,
            false => heard + SILENCE,
        };
        // the timer is set anew when it goes off, not with every byte
        while self.look.as_mut().poll(context).is_ready() {
            let end = end(self.heard);
            if end <= Instant::now() {
                if !self.overdue && place.caller().is_silent() {
                    shared.turned_away.fetch_add(1, Ordering::Relaxed);
                }
                self.overdue = true;
                return Err(io::ErrorKind::TimedOut.into());
            }
            self.look.as_mut().reset(end);
        }
        Ok(())
    }

    /// What the stream says, or that it is time to end.
    fn polled<T>(
        &mut self,
        context: &mut Context<'_>,
        poll: impl FnOnce(Pin<&mut TcpStream>, &mut Context<'_>) -> Poll<io::Result<T>>,
    ) -> Poll<io::Result<T>> {
        self.check(context)?;
        match &mut self.stream {
            Some(stream) => poll(Pin::new(stream), context),
            None => Poll::Ready(Err(io::ErrorKind::NotConnected.into())),
        }
    }

    fn written(&self, outcome: Poll<io::Result<usize>>) -> Poll<io::Result<usize>> {
        if let (Poll::Ready(Ok(bytes)), Some(place)) = (&outcome, &self.place) {
            let sent = &place.connections().0.sent;
            sent.fetch_add(*bytes as u64, Ordering::Relaxed);
        }
        outcome
    }
}

impl Drop for Connection {
    /// What the peer has sent and nobody has read would have the system take back what it was told last: why it is
    /// refused.
    fn drop(&mut self) {
        let (Some(mut stream), Some(place)) = (self.stream.take(), self.place.take()) else {
            return;
        };
        if self.overdue || place.caller().was_let_in() {
            return;
        }
        if let Ok(runtime) = Handle::try_current() {
            runtime.spawn(async move {
                let _until_then = place;
                let rest = async {
                    stream.shutdown().await?;
                    let mut rest = stream.take(LINGER_BYTES);
                    tokio::io::copy(&mut rest, &mut tokio::io::sink()).await
                };
                // the peer may be gone, or not hang up
                let _ = timeout(LINGER, rest).await;
            });
        }
    }
}

impl Connected for Connection {
    type ConnectInfo = TcpConnectInfo;

    fn connect_info(&self) -> TcpConnectInfo {
        match &self.stream {
            Some(stream) => stream.connect_info(),
            None => TcpConnectInfo {
                local_addr: None,
                remote_addr: None,
            },
        }
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        into: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = into.filled().len();
        let outcome = self.polled(context, |stream, context| stream.poll_read(context, into));
        if matches!(outcome, Poll::Ready(Ok(()))) {
            self.heard = Instant::now();
            if let Some(place) = &self.place {
                let bytes = (into.filled().len() - before) as u64;
                let received = &place.connections().0.received;
                received.fetch_add(bytes, Ordering::Relaxed);
            }
        }
        outcome
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        from: &[u8],
    ) -> Poll<io::Result<usize>> {
        let outcome = self.polled(context, |stream, context| stream.poll_write(context, from));
        self.written(outcome)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        from: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let outcome = self.polled(context, |stream, context| {
            stream.poll_write_vectored(context, from)
        });
        self.written(outcome)
    }

    fn is_write_vectored(&self) -> bool {
        true
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.polled(context, |stream, context| stream.poll_flush(context))
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        self.polled(context, |stream, context| stream.poll_shutdown(context))
    }
}
