//! The port where metrics are read. It asks for no credentials, so it takes on little: a few connections, each of
//! which ends soon.

use std::future::poll_fn;
use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use axum::serve::Listener;
use nestrad_proto::connections::{Connection, ConnectionLimits, Connections, Incoming};
use tokio::net::TcpListener;

/// A connection is closed after `first_call`, whatever comes on it.
const LIMITS: ConnectionLimits = ConnectionLimits {
    connections: 64,
    of_an_address: 32,
    first_call: Duration::from_secs(10),
};

pub(super) struct MetricsPort(Incoming);

impl MetricsPort {
    pub(super) fn new(listener: TcpListener) -> Self {
        Self(Connections::new(LIMITS).incoming(listener))
    }
}

impl Listener for MetricsPort {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        let connection = poll_fn(|context| self.0.poll_accept(context)).await;
        let peer = connection.peer();
        (connection, peer)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.0.local_addr()
    }
}
