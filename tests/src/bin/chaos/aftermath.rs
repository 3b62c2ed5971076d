//! When all faults are over: everything is as it was.

use std::thread;
use std::time::{Duration, Instant};

use nestrad_proto::v1::{SolveState, StatusResponse};

use crate::bounds;
use crate::calls;
use crate::clients::Client;
use crate::inflict::Victims;
use crate::scenes::Case;
use crate::verdict::End;

/// A client that nothing was done to has the right bytes of every scene, and the service comes to rest.
pub(crate) fn check(victims: &Victims, fresh: &Client, cases: &[Case]) {
    let record = &victims.record;
    for (turn, case) in cases.iter().enumerate() {
        let right = matches!(fresh.solve(case, turn as u64), Some(End::Right));
        record.check("a fresh client has its right bytes", right, case.name);
        if !right {
            // the others would wait as long
            break;
        }
    }
    let begun = Instant::now();
    let mut found = "no answer".to_owned();
    let mut rests = false;
    while !rests && begun.elapsed() < bounds::AT_REST {
        thread::sleep(Duration::from_millis(500));
        if let Ok(status) = calls::status(victims.master.address, bounds::ANSWER) {
            (rests, found) = is_at_rest(&status);
        }
    }
    record.check("the service comes to rest", rests, &found);
    record.event("rest", format!("{found} after {:.1?}", begun.elapsed()));
}

fn is_at_rest(status: &StatusResponse) -> (bool, String) {
    let active = |state: SolveState| matches!(state, SolveState::Queued | SolveState::Running);
    let solves = status.solves.iter().filter(|solve| active(solve.state()));
    let (solves, workers) = (solves.count(), status.workers.len());
    let jobs = status.jobs_waiting + status.jobs_leased;
    let rests = solves == 0 && jobs == 0 && workers == bounds::WORKERS;
    let text = format!(
        "{solves} solves that have not ended, {jobs} jobs, {workers} workers, {} bytes of scenes, {} of results",
        status.scene_bytes, status.result_bytes
    );
    (rests, text)
}
