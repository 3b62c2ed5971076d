//! Who is connected, from where, and who gives way to whom.

use std::collections::{BTreeMap, HashMap};
use std::net::{IpAddr, Ipv6Addr, SocketAddr};
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Waker};

use super::{ConnectionLimits, Connections};

/// Whoever is at the other end of a connection.
#[derive(Debug, Default)]
pub(super) struct Caller {
    standing: AtomicU8,
    hung_up: AtomicBool,
    waiting: Mutex<Option<Waker>>,
}

/// It has made no call that was answered.
const SILENT: u8 = 0;
/// It has made a call that anybody may make.
const HAS_ASKED: u8 = 1;
/// It has made a call that was let in.
const LET_IN: u8 = 2;

impl Caller {
    pub(super) fn is_silent(&self) -> bool {
        self.standing.load(Ordering::Relaxed) == SILENT
    }

    pub(super) fn was_let_in(&self) -> bool {
        self.standing.load(Ordering::Relaxed) == LET_IN
    }

    pub(super) fn has_asked(&self) {
        self.standing.fetch_max(HAS_ASKED, Ordering::Relaxed);
    }

    pub(super) fn is_let_in(&self) {
        self.standing.fetch_max(LET_IN, Ordering::Relaxed);
    }

    fn hang_up(&self) {
        self.hung_up.store(true, Ordering::Release);
        if let Some(waker) = lock(&self.waiting).take() {
            waker.wake();
        }
    }

    /// Whether its connection is to be closed; if not, `context` is woken when it is.
    pub(super) fn is_hung_up(&self, context: &Context<'_>) -> bool {
        if !self.was_let_in() {
            let mut waiting = lock(&self.waiting);
            if waiting
                .as_ref()
                .is_none_or(|w| !w.will_wake(context.waker()))
            {
                *waiting = Some(context.waker().clone());
            }
        }
        self.hung_up.load(Ordering::Acquire)
    }
}

/// All connections that are open.
#[derive(Debug, Default)]
pub(super) struct Register(Mutex<Entries>);

#[derive(Debug, Default)]
struct Entries {
    next: u64,
    /// By their order.
    open: BTreeMap<u64, (SocketAddr, Arc<Caller>)>,
    numbers: HashMap<SocketAddr, u64>,
    of_address: HashMap<IpAddr, usize>,
}

/// Whether there is room for a connection; it has a number then.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Room {
    Free(u64),
    /// Another was hung up for it.
    OfAnother(u64),
    None,
}

impl Register {
    pub(super) fn count(&self) -> usize {
        lock(&self.0).open.len()
    }

    /// Does something for the caller at an address, if it is there.
    pub(super) fn with(&self, address: SocketAddr, what: impl FnOnce(&Caller)) {
        if let Some(caller) = self.caller(address) {
            what(&caller);
        }
    }

    pub(super) fn caller(&self, address: SocketAddr) -> Option<Arc<Caller>> {
        let entries = lock(&self.0);
        let number = entries.numbers.get(&address)?;
        Some(entries.open.get(number)?.1.clone())
    }

    pub(super) fn admit(&self, address: SocketAddr, limits: &ConnectionLimits) -> Room {
        let mut entries = lock(&self.0);
        let of_address = entries.of_address.get(&network(address)).copied();
        let gives_way = if of_address.unwrap_or(0) >= limits.of_an_address {
            entries.oldest_stranger(Some(network(address)))
        } else if entries.open.len() >= limits.connections {
            entries.oldest_stranger(None)
        } else {
            return Room::Free(entries.enter(address));
        };
        match gives_way {
            Some(number) => {
                entries.hang_up(number);
                Room::OfAnother(entries.enter(address))
            }
            None => Room::None,
        }
    }

    /// Hangs up whoever has been there for longest without being let in.
    pub(super) fn hang_up_oldest(&self) {
        let mut entries = lock(&self.0);
        if let Some(number) = entries.oldest_stranger(None) {
            entries.hang_up(number);
        }
    }
}

impl Entries {
    fn enter(&mut self, address: SocketAddr) -> u64 {
        let number = self.next;
        self.next += 1;
        self.open.insert(number, (address, Arc::default()));
        self.numbers.insert(address, number);
        *self.of_address.entry(network(address)).or_default() += 1;
        number
    }

    fn oldest_stranger(&self, of: Option<IpAddr>) -> Option<u64> {
        let mut open = self.open.iter();
        let is_one = |(address, caller): &(SocketAddr, Arc<Caller>)| {
            !caller.was_let_in() && of.is_none_or(|of| of == network(*address))
        };
        open.find(|(_, entry)| is_one(entry))
            .map(|(number, _)| *number)
    }

    fn hang_up(&mut self, number: u64) {
        if let Some(caller) = self.leave(number) {
            caller.hang_up();
        }
    }

    fn leave(&mut self, number: u64) -> Option<Arc<Caller>> {
        let (address, caller) = self.open.remove(&number)?;
        // the address may be in use again
        if self.numbers.get(&address) == Some(&number) {
            self.numbers.remove(&address);
        }
        let network = network(address);
        if let Some(count) = self.of_address.get_mut(&network) {
            *count -= 1;
            if *count == 0 {
                self.of_address.remove(&network);
            }
        }
        Some(caller)
    }
}

/// What counts as one address: of IPv6 what a single machine is usually given.
fn network(address: SocketAddr) -> IpAddr {
    match address.ip().to_canonical() {
        IpAddr::V6(ip) => Ipv6Addr::from_bits(ip.to_bits() >> 64 << 64).into(),
        v4 => v4,
    }
}

/// The place of a connection among all, given back with this.
#[derive(Debug)]
pub(super) struct Place {
    connections: Connections,
    address: SocketAddr,
    number: u64,
    caller: Arc<Caller>,
}

impl Place {
    pub(super) fn new(
        connections: Connections,
        address: SocketAddr,
        number: u64,
        caller: Arc<Caller>,
    ) -> Self {
        Self {
            connections,
            address,
            number,
            caller,
        }
    }

    pub(super) fn connections(&self) -> &Connections {
        &self.connections
    }

    pub(super) fn address(&self) -> SocketAddr {
        self.address
    }

    pub(super) fn caller(&self) -> &Caller {
        &self.caller
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        tracing::trace!(address = %self.address, "connection closed");
        lock(&self.connections.0.register.0).leave(self.number);
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // what is behind is whole at any time
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
