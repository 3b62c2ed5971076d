//! `nestrad status`: what a master is doing.

use std::fmt::Write as _;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::Args;
use nestrad_proto::channel::{self, Credentials};
use nestrad_proto::v1;
use nestrad_service::client;
use tokio::time::timeout;

use super::console;
use super::exit::Unanswered;
use nestrad_common::printable::line as printable;

/// A master answers within this.
const ANSWER: Duration = Duration::from_secs(15);

/// Solves that have ended and are shown: the last ones.
const MOST_ENDED: usize = 10;

/// Show what a master is doing: its workers, solves, jobs and rates
#[derive(Debug, Args)]
pub(crate) struct StatusArgs {
    /// The master
    #[arg(long, value_name = "URL")]
    master: String,

    #[command(flatten)]
    credentials: Credentials,
}

impl StatusArgs {
    pub(crate) fn run(self) -> Result<()> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .context("cannot start threads")?;
        let status = runtime.block_on(async {
            let channel = channel::connect(&self.master, &self.credentials)?;
            let mut master = client::client(channel);
            let answer = timeout(ANSWER, master.status(v1::StatusRequest {})).await;
            let answer = answer.unwrap_or_else(|_| Err(tonic::Status::unavailable("no answer")));
            let answer = answer.map_err(|status| Unanswered {
                master: self.master.clone(),
                status,
            });
            Ok::<_, anyhow::Error>(answer?)
        })?;
        console::print(text(&status.into_inner()).as_bytes())
    }
}

fn text(status: &v1::StatusResponse) -> String {
    let mut text = String::new();
    let mut line = |what: &str, content: String| {
        // writing to a string does not fail
        let _ = writeln!(text, "{what:<10}{content}");
    };
    line(
        "master",
        format!(
            "version {}, up {}",
            printable(&status.version),
            time(status.uptime_s)
        ),
    );
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    line(
        "memory",
        format!(
            "{} scenes, {:.1} MiB; {} traced canopies, {:.1} MiB; results, {:.1} MiB",
            status.scenes,
            mebibytes(status.scene_bytes),
            status.traced_canopies,
            mebibytes(status.traced_canopy_bytes),
            mebibytes(status.result_bytes)
        ),
    );
    for worker in &status.workers {
        line(
            "worker",
            format!(
                "{}: {} threads, {:.2} GiB; {} jobs leased, {} done, {} lost; last message {} ago{}",
                printable(&worker.name),
                worker.threads,
                worker.memory_gi_b,
                worker.leased,
                worker.done,
                worker.lost,
                time(worker.silent_s),
                too_small(worker)
            ),
        );
    }
    for worker in &status.untrusted_workers {
        let worker = printable(worker);
        line(
            "refused",
            format!("worker {worker}: it returned wrong rows"),
        );
    }
    line(
        "jobs",
        format!(
            "{} waiting, {} leased, {} done; {} audited since the start",
            status.jobs_waiting, status.jobs_leased, status.jobs_done, status.jobs_audited
        ),
    );
    line(
        "rate",
        format!(
            "{:.2} M segments/s, {:.2} M rays/s over the last minute",
            status.segments_per_s / 1e6,
            status.rays_per_s / 1e6
        ),
    );
    if let Some(eta_s) = status.eta_s {
        line("left", time(eta_s));
    }
    let ended = |solve: &&v1::SolveInfo| {
        !matches!(
            solve.state(),
            v1::SolveState::Queued | v1::SolveState::Running
        )
    };
    let not_shown = status.solves.iter().filter(ended).count();
    let not_shown = not_shown.saturating_sub(MOST_ENDED);
    if not_shown > 0 {
        line(
            "solves",
            format!("{not_shown} older ones that have ended, and these:"),
        );
    }
    let mut left_out = 0;
    for solve in &status.solves {
        if ended(&solve) && left_out < not_shown {
            left_out += 1;
        } else {
            line("solve", self::solve(solve));
        }
    }
    text
}

fn too_small(worker: &v1::WorkerInfo) -> String {
    let needs = worker.needs_memory_gi_b;
    let said = |needs| format!("; idle: too small, the smallest block needs {needs:.2} GiB");
    needs.map(said).unwrap_or_default()
}

fn solve(solve: &v1::SolveInfo) -> String {
    let size = format!("{} triangles, {} bands", solve.triangles, solve.bands);
    let state = match solve.state() {
        v1::SolveState::Queued => format!("waiting for {}", time(solve.age_s)),
        v1::SolveState::Running if solve.total > 0 => format!(
            "running for {}: {}, {} of {}",
            time(solve.running_s),
            printable(&solve.stage),
            solve.done,
            solve.total
        ),
        v1::SolveState::Running => format!(
            "running for {}: {}",
            time(solve.running_s),
            printable(&solve.stage)
        ),
        v1::SolveState::Finished => format!("finished in {}", time(solve.running_s)),
        v1::SolveState::Failed => "failed".to_owned(),
        v1::SolveState::Cancelled => "cancelled".to_owned(),
        v1::SolveState::Unspecified => "in a state that this version does not know".to_owned(),
    };
    format!("{} ({size}) {state}", printable(&solve.solve_id))
}

fn time(seconds: f64) -> String {
    if seconds < 60.0 {
        return format!("{seconds:.1} s");
    }
    let minutes = (seconds / 60.0).round() as u64;
    match (minutes / 60, minutes % 60) {
        (0, minutes) => format!("{minutes} min"),
        (hours, minutes) => format!("{hours} h {minutes} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_said_and_nothing_steers_the_terminal() {
        let status = v1::StatusResponse {
            version: "1".into(),
            uptime_s: 7261.0,
            workers: vec![v1::WorkerInfo {
                name: "a\u{1b}[2J".into(),
                threads: 2,
                needs_memory_gi_b: Some(1.204),
                ..v1::WorkerInfo::default()
            }],
            untrusted_workers: vec!["b\u{1b} at 10.0.0.7".into()],
            eta_s: Some(90.0),
            solves: vec![v1::SolveInfo {
                solve_id: "ab".into(),
                state: v1::SolveState::Running.into(),
                stage: "exchange".into(),
                done: 3,
                total: 16,
                running_s: 4.0,
                ..v1::SolveInfo::default()
            }],
            ..v1::StatusResponse::default()
        };
        let text = text(&status);
        for part in [
            "up 2 h 1 min",
            "2 threads",
            "at 10.0.0.7: it returned wrong rows",
            "idle: too small, the smallest block needs 1.20 GiB",
            "exchange, 3 of 16",
            "left      2 min",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(!text.contains('\u{1b}'));
    }

    #[test]
    fn of_many_solves_that_have_ended_the_last_are_shown() {
        let solve = |id: usize, state: v1::SolveState| v1::SolveInfo {
            solve_id: format!("id{id:03}"),
            state: state.into(),
            ..v1::SolveInfo::default()
        };
        let mut solves = vec![solve(0, v1::SolveState::Running)];
        solves.extend((1..=30).map(|id| solve(id, v1::SolveState::Finished)));
        let text = text(&v1::StatusResponse {
            solves,
            ..v1::StatusResponse::default()
        });
        assert!(
            text.contains("20 older ones that have ended, and these:"),
            "{text}"
        );
        for (id, shown) in [
            ("id000", true),
            ("id020", false),
            ("id021", true),
            ("id030", true),
        ] {
            assert_eq!(text.contains(id), shown, "{id}: {text}");
        }
    }
}
