//! What is looked at all the time: the master lives, answers, and takes no more than stated.

use std::fs;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use crate::bounds;
use crate::calls;
use crate::inflict::Victims;
use crate::process::lock;
use crate::trouble::Kind;

/// Between two looks.
const PAUSE: Duration = Duration::from_millis(250);

/// Between two questions to the master.
const ASKED: Duration = Duration::from_secs(5);

/// Looks until it is told to stop.
pub(crate) fn watch(victims: &Victims, last_end: &Mutex<Instant>, stop: &AtomicBool) {
    let mut asked = Instant::now();
    while !stop.load(Ordering::SeqCst) {
        thread::sleep(PAUSE);
        look_at_master(victims);
        for worker in &victims.workers {
            worker.look_after();
        }
        let still = lock(last_end).elapsed();
        let moves = still < bounds::STANDSTILL;
        let what = "some client ends all the time";
        victims
            .record
            .check(what, moves, format!("none for {still:.1?}"));
        if !moves {
            // said once, not four times a second
            *lock(last_end) = Instant::now();
        }
        if asked.elapsed() > ASKED {
            ask(victims);
            asked = Instant::now();
        }
    }
}

fn look_at_master(victims: &Victims) {
    let record = &victims.record;
    if let Some((status, said)) = victims.master.ended() {
        let what = "the master goes on whatever happens";
        record.check(what, false, format!("{status}: {said}"));
        victims.master.start(false);
    }
    let Some(taken) = victims.master.pid().and_then(taken) else {
        return;
    };
    let (bytes, files) = taken;
    record.taken(bytes, files);
    let memory = bytes as f64 <= bounds::MEMORY_BYTES;
    let text = format!("{bytes} bytes, expected {}", bounds::MEMORY_BYTES);
    record.check("memory of the master is bounded", memory, text);
    let text = format!("{files} open files, expected {}", bounds::FILES);
    record.check(
        "open files of the master are bounded",
        files <= bounds::FILES,
        text,
    );
}

/// Memory of a process and its open files.
fn taken(pid: u32) -> Option<(u64, u64)> {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    let files = fs::read_dir(format!("/proc/{pid}/fd")).ok()?.count();
    Some((1024 * kib, files as u64))
}

/// The master says how it is, where nothing keeps it from that.
fn ask(victims: &Victims) {
    let begun = Instant::now();
    let answer = calls::status(victims.master.address, bounds::ANSWER);
    let kept = [
        Kind::MasterKilled,
        Kind::MasterTerminated,
        Kind::MasterPaused,
    ];
    if kept
        .iter()
        .any(|&kind| victims.troubles.just_now(kind, begun))
    {
        return;
    }
    let found = answer.as_ref().err().map(ToString::to_string);
    let text = found.unwrap_or_default();
    let what = "the master answers";
    victims.record.check(what, answer.is_ok(), text);
}
