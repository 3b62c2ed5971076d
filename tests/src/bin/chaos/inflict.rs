//! Faults are made, and mended when their time is over.

use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use nestrad_tests::proxy::{Proxy, Way};
use nestrad_tests::random::Dice;

use crate::clients::Client;
use crate::clock::Clock;
use crate::faults::{Fault, Turn};
use crate::ground::{Disk, Ground};
use crate::master::Master;
use crate::process::Reader;
use crate::record::Record;
use crate::trouble::{Kind, Troubles};
use crate::workers::Worker;
use crate::{bounds, hostile_clients, hostile_workers};

/// All that something can go wrong with.
pub(crate) struct Victims {
    pub(crate) ground: Arc<Ground>,
    pub(crate) clock: Arc<Clock>,
    pub(crate) record: Arc<Record>,
    pub(crate) troubles: Arc<Troubles>,
    pub(crate) master: Arc<Master>,
    pub(crate) workers: Vec<Worker>,
    pub(crate) clients: Vec<Client>,
    /// Held by who ends the master, until it serves again.
    pub(crate) restarts: Mutex<()>,
}

impl Victims {
    /// Makes a fault on a thread of its own, which ends when all is mended.
    pub(crate) fn inflict(self: &Arc<Self>, turn: Turn) -> JoinHandle<()> {
        let victims = self.clone();
        thread::spawn(move || victims.make(&turn))
    }

    fn make(&self, turn: &Turn) {
        let worker = &self.workers[turn.whom % bounds::WORKERS];
        let client = &self.clients[turn.whom % bounds::CLIENTS];
        let lasts = turn.lasts;
        match turn.fault {
            Fault::KillWorker => {
                self.says(turn, "worker");
                worker.kill();
                thread::sleep(lasts);
                worker.start();
            }
            Fault::TerminateWorker => {
                self.says(turn, "worker");
                worker.terminate();
                thread::sleep(lasts);
                worker.start();
            }
            Fault::PauseWorker => {
                self.says(turn, "worker");
                worker.pause(lasts);
            }
            Fault::KillClient => {
                self.says(turn, "client");
                client.kill();
            }
            Fault::InterruptClient => {
                self.says(turn, "client");
                client.interrupt();
            }
            Fault::PauseClient => {
                self.says(turn, "client");
                client.pause(lasts);
            }
            Fault::KillMaster => self.restart(turn, Kind::MasterKilled, Master::kill),
            Fault::TerminateMaster => self.restart(turn, Kind::MasterTerminated, Master::terminate),
            Fault::PauseMaster => {
                self.says(turn, "");
                let _trouble = self.troubles.begin(Kind::MasterPaused);
                self.master.pause(lasts);
            }
            Fault::StateDiskFull => self.fill(turn, &self.ground.state),
            Fault::LogDiskFull if !self.master.logs_to_disk() => {
                self.skips(turn, "the log goes to a pipe now");
            }
            Fault::LogDiskFull => self.fill(turn, &self.ground.log),
            Fault::OutDiskFull if self.ground.out.is_mounted => {
                self.says(turn, "client");
                client.write_to_full_disk();
            }
            Fault::OutDiskFull => self.skips(turn, "no disk can be mounted"),
            Fault::WayOfWorker(way) => {
                self.says(turn, "worker");
                along(&worker.way, way, lasts);
            }
            Fault::WayOfClient(way) => {
                self.says(turn, "client");
                let _trouble = self.troubles.begin(Kind::Way(client.number));
                along(&client.way, way, lasts);
            }
            Fault::ResetWorker => {
                self.says(turn, "worker");
                worker.way.reset();
            }
            Fault::ResetClient => {
                self.says(turn, "client");
                let _trouble = self.troubles.begin(Kind::Way(client.number));
                client.way.reset();
            }
            Fault::ClockStep => self.step_clock(turn),
            Fault::LogReaderGone => self.log_reader(turn, Reader::Gone),
            Fault::LogReaderSleeps => self.log_reader(turn, Reader::Sleeps),
            Fault::WorkersLogReaderGone => {
                self.says(turn, "worker");
                worker.set_reader(Reader::Gone);
            }
            Fault::ClientUnheard => {
                self.says(turn, "client");
                client.unheard();
            }
            Fault::HostileWorker(kind) => {
                self.says(turn, "");
                let did = hostile_workers::act(kind, self.master.address, turn.seed, lasts);
                self.record
                    .event("hostile", format!("worker that {kind}: {did}"));
            }
            Fault::HostileClient(kind) => {
                self.says(turn, "");
                let did = hostile_clients::act(kind, self.master.address, turn.seed, lasts);
                self.record
                    .event("hostile", format!("client that {kind}: {did}"));
            }
        }
    }

    fn says(&self, turn: &Turn, whom: &str) {
        let whom = match whom {
            "worker" => format!("worker {}, ", turn.whom % bounds::WORKERS),
            "client" => format!("client {}, ", turn.whom % bounds::CLIENTS),
            _ => String::new(),
        };
        let text = format!("{whom}{:.1?}", turn.lasts);
        self.record.fault(&turn.fault.names().1, text);
    }

    fn skips(&self, turn: &Turn, why: &str) {
        self.record.skipped(&turn.fault.names().1, why);
    }

    /// Ends the master and starts it again with the same state.
    fn restart(&self, turn: &Turn, kind: Kind, end: impl FnOnce(&Master)) {
        let Ok(_restarts) = self.restarts.try_lock() else {
            return self.skips(turn, "the master is not there");
        };
        self.says(turn, "");
        let _trouble = self.troubles.begin(kind);
        end(&self.master);
        thread::sleep(turn.lasts);
        self.master.start(turn.seed.is_multiple_of(2));
    }

    fn fill(&self, turn: &Turn, disk: &Disk) {
        if !disk.is_mounted {
            return self.skips(turn, "no disk can be mounted");
        }
        self.says(turn, "");
        let filled = disk.fill();
        self.record
            .check("disks can be filled", filled.is_ok(), format!("{filled:?}"));
        thread::sleep(turn.lasts);
        disk.free();
    }

    /// What becomes of whoever reads the log of the master, for a time, or until it is started again.
    fn log_reader(&self, turn: &Turn, reader: Reader) {
        if !self.master.set_reader(reader) {
            return self.skips(turn, "the log goes to a disk now");
        }
        self.says(turn, "");
        thread::sleep(turn.lasts);
        if reader == Reader::Sleeps {
            self.master.set_reader(Reader::Listens);
        }
    }

    fn step_clock(&self, turn: &Turn) {
        if !self.clock.is_there {
            return self.skips(
                turn,
                "libfaketime is not there (Debian: apt install libfaketime)",
            );
        }
        let mut dice = Dice(turn.seed);
        let steps = [-365 * 86_400, -3600, -30, 30, 3600, 365 * 86_400];
        let seconds = steps[dice.below(steps.len())];
        let text = format!("{seconds} s for {:.1?}", turn.lasts);
        self.record.fault(&turn.fault.names().1, text);
        let set = self.clock.set(seconds);
        thread::sleep(turn.lasts);
        let set = set.and(self.clock.set(0));
        self.record
            .check("clocks can be set", set.is_ok(), format!("{set:?}"));
    }
}

/// A way fares so for a time.
fn along(proxy: &Proxy, way: Way, lasts: Duration) {
    proxy.set(way);
    thread::sleep(lasts);
    proxy.heal();
}
