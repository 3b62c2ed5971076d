//! A way between two processes that can fail as networks do, and heals.

use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// What becomes of bytes on their way. None is ever lost: what does not go on waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// All go on.
    Open,
    /// None do, as in a network whose middle is gone.
    Cut,
    /// Only those of the side that connected do: it is heard and hears nothing.
    HalfOpen,
    /// They go on at 20 KB/s each way.
    Slow,
}

/// Forwards connections.
pub struct Proxy {
    /// Where to connect to.
    pub address: SocketAddr,
    shared: Arc<Shared>,
}

struct Shared {
    way: Mutex<Way>,
    /// Both ends of every connection, by its number.
    open: Mutex<HashMap<u64, [TcpStream; 2]>>,
}

impl Proxy {
    /// A way to `to`.
    pub fn new(to: SocketAddr) -> Self {
        Self::from(Ipv4Addr::LOCALHOST, to)
    }

    /// A way to `to`, at whose end connections come from an address of this machine.
    pub fn from(source: Ipv4Addr, to: SocketAddr) -> Self {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let address = listener.local_addr().unwrap();
        let shared = Arc::new(Shared {
            way: Mutex::new(Way::Open),
            open: Mutex::default(),
        });
        let kept = shared.clone();
        thread::spawn(move || {
            let near = listener.incoming().map_while(Result::ok);
            for (number, near) in (0..).zip(near) {
                // a connection that cannot be forwarded is closed, as if nobody listened
                if let Ok(far) = connect(source, to) {
                    let _ = forward_both(number, near, far, &kept);
                }
            }
        });
        Self { address, shared }
    }

    /// From now on bytes fare so.
    pub fn set(&self, way: Way) {
        *lock(&self.shared.way) = way;
    }

    /// Nothing goes through any more.
    pub fn cut(&self) {
        self.set(Way::Cut);
    }

    /// Everything goes through again.
    pub fn heal(&self) {
        self.set(Way::Open);
    }

    /// Ends all connections that there are now.
    pub fn reset(&self) {
        for stream in lock(&self.shared.open).drain().flat_map(|(_, both)| both) {
            // it may have ended by itself
            let _ = stream.shutdown(Shutdown::Both);
        }
    }
}

fn connect(source: Ipv4Addr, to: SocketAddr) -> std::io::Result<TcpStream> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()?;
    let stream = runtime.block_on(async {
        let socket = tokio::net::TcpSocket::new_v4()?;
        socket.bind((source, 0).into())?;
        socket.connect(to).await?.into_std()
    })?;
    stream.set_nonblocking(false)?;
    Ok(stream)
}

fn forward_both(
    number: u64,
    near: TcpStream,
    far: TcpStream,
    shared: &Arc<Shared>,
) -> std::io::Result<()> {
    for stream in [&near, &far] {
        stream.set_nodelay(true)?;
    }
    let ways = [
        (near.try_clone()?, far.try_clone()?, true),
        (far.try_clone()?, near.try_clone()?, false),
    ];
    lock(&shared.open).insert(number, [near, far]);
    for (from, to, outwards) in ways {
        let shared = shared.clone();
        thread::spawn(move || {
            forward(from, to, outwards, &shared);
            lock(&shared.open).remove(&number);
        });
    }
    Ok(())
}

fn forward(mut from: TcpStream, mut to: TcpStream, outwards: bool, shared: &Shared) {
    let mut buffer = [0; 16 << 10];
    loop {
        let most = match *lock(&shared.way) {
            Way::Slow => 1 << 10,
            _ => buffer.len(),
        };
        let Ok(n) = from.read(&mut buffer[..most]) else {
            break;
        };
        wait(shared, outwards);
        if n == 0 || to.write_all(&buffer[..n]).is_err() {
            break;
        }
    }
    // the other side hears of it by its own read
    for stream in [from, to] {
        let _ = stream.shutdown(Shutdown::Both);
    }
}

/// Until bytes may go on.
fn wait(shared: &Shared, outwards: bool) {
    loop {
        let way = *lock(&shared.way);
        match way {
            Way::Open => return,
            Way::HalfOpen if outwards => return,
            Way::Slow => return thread::sleep(Duration::from_millis(50)),
            Way::Cut | Way::HalfOpen => thread::sleep(Duration::from_millis(5)),
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
