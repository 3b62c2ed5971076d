//! All that can go wrong in a run, and the order in which it does, which the seed alone decides.

use std::time::Duration;

use nestrad_tests::proxy::Way;
use nestrad_tests::random::Dice;

use crate::hostile_clients::ClientKind;
use crate::hostile_workers::WorkerKind;

/// Something that goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    KillWorker,
    KillClient,
    KillMaster,
    TerminateWorker,
    TerminateMaster,
    InterruptClient,
    PauseWorker,
    PauseClient,
    PauseMaster,
    StateDiskFull,
    LogDiskFull,
    OutDiskFull,
    WayOfWorker(Way),
    WayOfClient(Way),
    ResetWorker,
    ResetClient,
    ClockStep,
    LogReaderGone,
    LogReaderSleeps,
    WorkersLogReaderGone,
    ClientUnheard,
    HostileWorker(WorkerKind),
    HostileClient(ClientKind),
}

impl Fault {
    /// The group that a run may be restricted to, and the name.
    pub(crate) fn names(self) -> (&'static str, String) {
        let (group, name) = match self {
            Self::KillWorker => ("kill", "kill -9 of a worker"),
            Self::KillClient => ("kill", "kill -9 of a client"),
            Self::KillMaster => ("kill", "kill -9 of the master"),
            Self::TerminateWorker => ("term", "SIGTERM to a worker"),
            Self::TerminateMaster => ("term", "SIGTERM to the master"),
            Self::InterruptClient => ("term", "SIGINT to a client"),
            Self::PauseWorker => ("stop", "SIGSTOP and SIGCONT of a worker"),
            Self::PauseClient => ("stop", "SIGSTOP and SIGCONT of a client"),
            Self::PauseMaster => ("stop", "SIGSTOP and SIGCONT of the master"),
            Self::StateDiskFull => ("disk", "disk of --state full"),
            Self::LogDiskFull => ("log", "disk of the log full"),
            Self::OutDiskFull => ("disk", "disk of --out full"),
            Self::WayOfWorker(way) => return ("partition", format!("way of a worker {way:?}")),
            Self::WayOfClient(way) => return ("partition", format!("way of a client {way:?}")),
            Self::ResetWorker => ("partition", "connections of a worker end"),
            Self::ResetClient => ("partition", "connections of a client end"),
            Self::ClockStep => ("clock", "clock step"),
            Self::LogReaderGone => ("log", "log reader gone"),
            Self::LogReaderSleeps => ("log", "log reader sleeps"),
            Self::WorkersLogReaderGone => ("log", "log reader of a worker gone"),
            Self::ClientUnheard => ("log", "nobody reads what a client says"),
            Self::HostileWorker(kind) => {
                return ("hostile-worker", format!("hostile worker that {kind}"));
            }
            Self::HostileClient(kind) => {
                return ("hostile-client", format!("hostile client that {kind}"));
            }
        };
        (group, name.to_owned())
    }

    fn all() -> Vec<Self> {
        let mut all = vec![
            Self::KillWorker,
            Self::KillClient,
            Self::KillMaster,
            Self::TerminateWorker,
            Self::TerminateMaster,
            Self::InterruptClient,
            Self::PauseWorker,
            Self::PauseClient,
            Self::PauseMaster,
            Self::StateDiskFull,
            Self::LogDiskFull,
            Self::OutDiskFull,
            Self::ResetWorker,
            Self::ResetClient,
            Self::ClockStep,
            Self::LogReaderGone,
            Self::LogReaderSleeps,
            Self::WorkersLogReaderGone,
            Self::ClientUnheard,
        ];
        for way in [Way::Cut, Way::HalfOpen, Way::Slow] {
            all.extend([Self::WayOfWorker(way), Self::WayOfClient(way)]);
        }
        all.extend(WorkerKind::ALL.map(Self::HostileWorker));
        all.extend(ClientKind::ALL.map(Self::HostileClient));
        all
    }
}

/// A fault, and what is drawn for it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turn {
    pub(crate) fault: Fault,
    /// Which worker or client, modulo how many there are.
    pub(crate) whom: usize,
    /// How long it lasts, or until what was ended is started again.
    pub(crate) lasts: Duration,
    /// For what else the fault has to draw.
    pub(crate) seed: u64,
    /// Until the next one.
    pub(crate) pause: Duration,
}

/// The faults of a run, one after the other: each once in random order, then all again.
pub(crate) struct Deck {
    dice: Dice,
    faults: Vec<Fault>,
    left: Vec<Fault>,
}

impl Deck {
    /// Of the faults whose group or name has one of `only` in it, if there are any, and none of `without`.
    pub(crate) fn new(seed: u64, only: &[String], without: &[String]) -> Self {
        let named = |fault: &Fault, words: &[String]| {
            let (group, name) = fault.names();
            words
                .iter()
                .any(|word| *word == group || name.contains(word.as_str()))
        };
        let mut faults = Fault::all();
        faults.retain(|fault| (only.is_empty() || named(fault, only)) && !named(fault, without));
        Self {
            dice: Dice(seed),
            faults,
            left: Vec::new(),
        }
    }
}

impl Iterator for Deck {
    type Item = Turn;

    fn next(&mut self) -> Option<Turn> {
        if self.left.is_empty() {
            self.left.clone_from(&self.faults);
        }
        let which = self.dice.below(self.left.len().max(1));
        let fault = (!self.left.is_empty()).then(|| self.left.swap_remove(which))?;
        let dice = &mut self.dice;
        // most are short; one in eight is longer than what peers wait for
        let long = dice.below(8) == 0;
        let seconds = if long {
            10.0 + 65.0 * dice.unit()
        } else {
            0.1 + 8.0 * dice.unit()
        };
        Some(Turn {
            fault,
            whom: dice.below(1000),
            lasts: Duration::from_secs_f64(seconds),
            seed: dice.below(usize::MAX) as u64,
            pause: Duration::from_secs_f64(1.0 + 4.0 * dice.unit()),
        })
    }
}
