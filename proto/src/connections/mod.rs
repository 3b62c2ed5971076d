//! Connections to a port: their number is bounded, in all and for each address; who does not make a call is hung up;
//! what goes over them is counted.
//!
//! Where all places are taken, a new connection takes the place of the oldest that nobody has been let in by: whoever
//! opens connections and is silent locks nobody out.

mod connection;
mod register;

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use rustix::process::{Resource, getrlimit, setrlimit};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::{Instant, Sleep};
use tokio_stream::Stream;

pub use connection::Connection;
use register::{Caller, Place, Register, Room};

/// What a port takes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ConnectionLimits {
    /// Connections at a time.
    pub connections: usize,
    /// Connections at a time from one address; of IPv6 from one network of 64 bits.
    pub of_an_address: usize,
    /// A connection is hung up where nobody has made a call on it that was answered after this: the handshake of TLS
    /// is part of that time.
    pub first_call: Duration,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            connections: 4096,
            of_an_address: 1024,
            first_call: Duration::from_secs(10),
        }
    }
}

impl ConnectionLimits {
    /// These limits, but for no more connections than this process may have files open. As many files are allowed as
    /// the system lets it have.
    #[must_use]
    pub fn within_open_files(mut self) -> Self {
        let mut allowed = getrlimit(Resource::Nofile);
        allowed.current = allowed.maximum;
        // where that is refused, what is allowed now counts
        let _ = setrlimit(Resource::Nofile, allowed);
        if let Some(files) = getrlimit(Resource::Nofile).current {
            let files = usize::try_from(files).unwrap_or(usize::MAX);
            // the rest is for files, and for connections that are about to close
            self.connections = self.connections.min(files / 2).max(1);
            self.of_an_address = self.of_an_address.min(self.connections.div_ceil(2));
        }
        self
    }
}

/// What went over the connections of a port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Open now.
    pub open: usize,
    /// Bytes that came in since the start.
    pub received: u64,
    /// Bytes that went out since the start.
    pub sent: u64,
    /// Connections that were closed before a call was let in: for lack of room, or because nobody spoke.
    pub turned_away: u64,
}

/// The connections of a port. Clones are the same.
#[derive(Clone, Debug, Default)]
pub struct Connections(Arc<Shared>);

#[derive(Debug, Default)]
struct Shared {
    limits: ConnectionLimits,
    register: Register,
    received: AtomicU64,
    sent: AtomicU64,
    turned_away: AtomicU64,
}

impl Connections {
    /// Of a port with these limits.
    pub fn new(limits: ConnectionLimits) -> Self {
        Self(Arc::new(Shared {
            limits,
            ..Shared::default()
        }))
    }

    /// What went over them.
    pub fn traffic(&self) -> Traffic {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        Traffic {
            open: self.0.register.count(),
            received: of(&self.0.received),
            sent: of(&self.0.sent),
            turned_away: of(&self.0.turned_away),
        }
    }

    /// The caller at `address` made a call that needs no credentials: it is not hung up for being silent.
    pub(crate) fn has_asked(&self, address: SocketAddr) {
        self.0.register.with(address, Caller::has_asked);
    }

    /// The caller at `address` made a call that was let in: its connection gives way to no other.
    pub(crate) fn is_let_in(&self, address: SocketAddr) {
        self.0.register.with(address, Caller::is_let_in);
    }

    /// All connections that come in at a port.
    pub fn incoming(&self, listener: TcpListener) -> Incoming {
        Incoming {
            listener,
            connections: self.clone(),
            pause: None,
            warned: None,
        }
    }

    /// A connection that has come in, if there is room.
    fn admit(&self, stream: TcpStream, address: SocketAddr) -> Option<Connection> {
        let room = self.0.register.admit(address, &self.0.limits);
        if !matches!(room, Room::Free(_)) {
            self.0.turned_away.fetch_add(1, Ordering::Relaxed);
        }
        let (Room::Free(number) | Room::OfAnother(number)) = room else {
            return None;
        };
        // only a matter of speed
        let _ = stream.set_nodelay(true);
        let caller = self.0.register.caller(address)?;
        let place = Place::new(self.clone(), address, number, caller);
        Some(Connection::new(stream, place))
    }
}

/// After an error of the system, connections are taken again after this.
const PAUSE: Duration = Duration::from_millis(50);

/// The log says so often at most that connections cannot be taken.
const WARN_EVERY: Duration = Duration::from_secs(10);

/// The connections that come in at a port, for ever.
#[derive(Debug)]
pub struct Incoming {
    listener: TcpListener,
    connections: Connections,
    pause: Option<Pin<Box<Sleep>>>,
    warned: Option<Instant>,
}

impl Incoming {
    /// Where they come in.
    pub fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// The next one.
    pub fn poll_accept(&mut self, context: &mut Context<'_>) -> Poll<Connection> {
        loop {
            if let Some(pause) = &mut self.pause {
                ready!(pause.as_mut().poll(context));
                self.pause = None;
            }
            match ready!(self.listener.poll_accept(context)) {
                Ok((stream, address)) => match self.connections.admit(stream, address) {
                    Some(connection) => return Poll::Ready(connection),
                    None => self.warn(&format!("{address}: all places of its address are taken")),
                },
                Err(error) => {
                    // of that connection, or of all for lack of files: neither ends the service
                    self.warn(&error.to_string());
                    self.connections.0.register.hang_up_oldest();
                    self.pause = Some(Box::pin(tokio::time::sleep(PAUSE)));
                }
            }
        }
    }

    fn warn(&mut self, reason: &str) {
        if self.warned.is_none_or(|at| at.elapsed() >= WARN_EVERY) {
            self.warned = Some(Instant::now());
            tracing::warn!(reason, "connection refused");
        }
    }
}

impl Stream for Incoming {
    type Item = io::Result<Connection>;

    fn poll_next(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<io::Result<Connection>>> {
        self.poll_accept(context)
            .map(|connection| Some(Ok(connection)))
    }
}

#[cfg(test)]
mod tests;
