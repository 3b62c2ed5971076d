//! Workers that mean no good, or are of no use.

use std::fmt;
use std::net::SocketAddr;
use std::thread;
use std::time::{Duration, Instant};

use nestrad_kernel::packed::Shape;
use nestrad_proto::v1::{JoinRequest, RowsHeader};
use nestrad_tests::random::Dice;
use tonic::Status;

use crate::lies::Lie;
use crate::visitor::Visitor;

/// What such a worker does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WorkerKind {
    /// Each result is valid and wrong.
    Lies(Lie),
    /// One result in ten is.
    LiesSometimes,
    /// Holds its leases, and never brings a result.
    OnlyRenews,
    /// One result that took for ever, and a lease that is held.
    ClaimsTime,
    /// Announces a gibibyte and sends a byte every two seconds.
    Promises,
    /// Fails, leaves, and comes back as another.
    FailsAndRejoins,
    /// Has no room for any job.
    TooSmall,
    /// Sends what is no result at all.
    Garbage,
    /// Sends few bytes that are very many entries.
    Swells,
    /// Takes a job and is not heard of again.
    Vanishes,
}

impl WorkerKind {
    pub(crate) const ALL: [Self; 14] = [
        Self::Lies(Lie::Scaled),
        Self::Lies(Lie::Swapped),
        Self::Lies(Lie::Dropped),
        Self::Lies(Lie::Moved),
        Self::Lies(Lie::OneOff),
        Self::LiesSometimes,
        Self::OnlyRenews,
        Self::ClaimsTime,
        Self::Promises,
        Self::FailsAndRejoins,
        Self::TooSmall,
        Self::Garbage,
        Self::Swells,
        Self::Vanishes,
    ];
}

impl fmt::Display for WorkerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::Lies(lie) => return write!(f, "lies ({lie:?})"),
            Self::LiesSometimes => "lies once in ten",
            Self::OnlyRenews => "only renews",
            Self::ClaimsTime => "claims 1e300 s",
            Self::Promises => "promises 1 GiB, a byte in 2 s",
            Self::FailsAndRejoins => "fails, leaves, rejoins",
            Self::TooSmall => "is too small",
            Self::Garbage => "sends garbage",
            Self::Swells => "sends few bytes of many entries",
            Self::Vanishes => "vanishes with its jobs",
        };
        f.write_str(text)
    }
}

/// How far it came.
#[derive(Debug, Default)]
struct Did {
    joined: u32,
    leased: u32,
    used: u32,
    refused: u32,
    /// Why it was last refused.
    why: String,
}

impl fmt::Display for Did {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            joined,
            leased,
            used,
            refused,
            why,
        } = self;
        write!(
            f,
            "joined {joined}, leased {leased}, used {used}, refused {refused}: {why}"
        )
    }
}

/// Does so for a time; says how far it came.
pub(crate) fn act(kind: WorkerKind, master: SocketAddr, seed: u64, lasts: Duration) -> String {
    // long enough to get a job
    let lasts = lasts.max(Duration::from_secs(4));
    let until = Instant::now() + lasts;
    let (mut did, mut dice) = (Did::default(), Dice(seed));
    while Instant::now() < until {
        if let Err(status) = visit(kind, master, until, &mut dice, &mut did) {
            did.refused += 1;
            did.why = format!("{:?}: {}", status.code(), status.message());
            thread::sleep(Duration::from_millis(200));
        }
    }
    did.to_string()
}

/// From joining until it is refused, or its time is over.
fn visit(
    kind: WorkerKind,
    master: SocketAddr,
    until: Instant,
    dice: &mut Dice,
    did: &mut Did,
) -> Result<(), Status> {
    let memory_bytes = match kind {
        WorkerKind::TooSmall => [1 << 20, 20 << 20][dice.below(2)],
        _ => 1 << 33,
    };
    let request = JoinRequest {
        name: format!("hostile {}", dice.below(1000)),
        threads: 4,
        memory_bytes,
        kernel: nestrad_kernel::kernel().to_owned(),
    };
    let visitor = Visitor::join(master, request)?;
    did.joined += 1;
    let mut held = Vec::new();
    while Instant::now() < until {
        if !held.is_empty() {
            visitor.renew(held.clone())?;
            thread::sleep(Duration::from_millis(300));
        }
        let Some(job) = visitor.ask(0.5)? else {
            continue;
        };
        did.leased += 1;
        match kind {
            WorkerKind::OnlyRenews => held.push(job.lease_id),
            WorkerKind::Vanishes => return Ok(()),
            WorkerKind::FailsAndRejoins => {
                visitor.fail(&job, "nothing works here")?;
                return visitor.leave();
            }
            WorkerKind::Lies(_)
            | WorkerKind::LiesSometimes
            | WorkerKind::ClaimsTime
            | WorkerKind::TooSmall
            | WorkerKind::Promises
            | WorkerKind::Garbage
            | WorkerKind::Swells => {
                let truth = visitor.compute(&job)?;
                let (header, packed) = made(kind, truth, dice);
                if kind == WorkerKind::Promises {
                    visitor.trickle(&header, Duration::from_secs(2), until)?;
                    continue;
                }
                did.used += u32::from(visitor.bring(&header, &packed)?);
                if kind == WorkerKind::ClaimsTime
                    && let Some(job) = visitor.ask(0.5)?
                {
                    held.push(job.lease_id);
                }
            }
        }
    }
    Ok(())
}

/// What such a worker makes of the result that it should send.
fn made(
    kind: WorkerKind,
    (mut header, mut packed, shape): (RowsHeader, Vec<u8>, Shape),
    dice: &mut Dice,
) -> (RowsHeader, Vec<u8>) {
    let lie = match kind {
        WorkerKind::Lies(lie) => Some(lie),
        WorkerKind::LiesSometimes if dice.below(10) == 0 => {
            Some(Lie::ALL[dice.below(Lie::ALL.len())])
        }
        WorkerKind::Swells => Some(Lie::Swollen(1 << 24)),
        _ => None,
    };
    if let Some(told) = lie.and_then(|lie| lie.told(&header, &packed, shape)) {
        return told;
    }
    match kind {
        WorkerKind::ClaimsTime => header.compute_s = 1e300,
        WorkerKind::Promises => (header.packed_bytes, header.entries) = (1 << 30, 1 << 30),
        WorkerKind::Garbage => {
            packed.fill(0xff);
            header.checksum = blake3::hash(&packed).as_bytes().to_vec();
        }
        _ => {}
    }
    (header, packed)
}
