//! Exit codes: what a script can tell from how a command ended. Every error of the command line gets its code here
//! and nowhere else, by its type.

use std::any::Any;
use std::error::Error;
use std::fmt;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;

use anyhow::Result;
use nestrad_cluster::door::DoorError;
use nestrad_engine::rounds::RoundsError;
use nestrad_engine::stop::Stopped;
use nestrad_engine::traced::{FailureKind, SolveError};
use nestrad_results::OutputError;
use nestrad_results::trade::TradeError;
use nestrad_service::client::{RefusalKind, RemoteError};
use nestrad_service::server::ServeError;
use rayon::ThreadPoolBuildError;
use thiserror::Error;

use super::console::note;
use super::series::SeriesMemory;

/// How a command ends; README.md and docs/operators.md say the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Exit {
    /// Input that cannot be used: a file, a value, a folder, an address.
    Input = 1,
    /// Flags that are wrong.
    Usage = 2,
    /// Results were written, but a fault kept them from the asked accuracy.
    Missed = 3,
    /// A limit does not allow it: memory, time, size, queue, disk space.
    Limit = 4,
    /// The master cannot be reached, went away, or refuses the caller.
    Master = 5,
    /// The solve failed by an inner fault.
    Fault = 6,
    /// Somebody stopped it.
    Cancelled = 130,
}

/// The results of an earlier round were written, for a finer one failed.
#[derive(Debug, Error)]
#[error(
    "the target error of {asked_percent} % was missed, because a finer round failed: {fault}; {place} has the \
     results of the round before{}", Reached(*.reached_percent)
)]
pub(crate) struct MissedTarget {
    /// As asked, percent.
    pub(crate) asked_percent: f64,
    /// Of the results that were written, percent.
    pub(crate) reached_percent: Option<f64>,
    /// What went wrong.
    pub(crate) fault: String,
    /// Where the results are.
    pub(crate) place: String,
}

struct Reached(Option<f64>);

impl fmt::Display for Reached {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0
            .map_or(Ok(()), |percent| write!(f, ", with {percent:.2} %"))
    }
}

/// A master did not answer as it should.
#[derive(Debug, Error)]
#[error("{master}: {}", nestrad_proto::reason::of(.status))]
pub(crate) struct Unanswered {
    /// Its address.
    pub(crate) master: String,
    /// What came instead of an answer.
    pub(crate) status: tonic::Status,
}

/// Runs a command, reports its error, and gives its exit code. A panic is an inner fault, and has been shown.
pub(crate) fn code_of(command: impl FnOnce() -> Result<()>) -> ExitCode {
    match catch_unwind(AssertUnwindSafe(command)) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => reported(&error),
        Err(panic) => {
            note("error", &format!("internal fault: {}", said(&*panic)));
            (Exit::Fault as u8).into()
        }
    }
}

fn reported(error: &anyhow::Error) -> ExitCode {
    if let Some(usage) = error.downcast_ref::<clap::Error>() {
        nestrad_proto::usage::say(usage);
        let code = u8::try_from(usage.exit_code());
        return code.unwrap_or(Exit::Usage as u8).into();
    }
    note("error", &super::console::chain(error));
    (of(error) as u8).into()
}

/// What a panic said.
fn said(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("the program panicked")
}

/// The first of an error and its causes that has a code of its own decides; input is at fault where none has.
fn of(error: &anyhow::Error) -> Exit {
    error.chain().find_map(of_one).unwrap_or(Exit::Input)
}

fn of_one(error: &(dyn Error + 'static)) -> Option<Exit> {
    if let Some(error) = error.downcast_ref::<RoundsError>() {
        return Some(of_kind(error.kind()));
    }
    if let Some(error) = error.downcast_ref::<SolveError>() {
        return Some(of_kind(error.kind()));
    }
    if let Some(error) = error.downcast_ref::<RemoteError>() {
        return Some(of_remote(error));
    }
    if let Some(Unanswered { status, .. }) = error.downcast_ref() {
        return Some(of_refusal(RefusalKind::of(status.code())));
    }
    if let Some(error) = error.downcast_ref::<io::Error>() {
        return of_io(error.kind());
    }
    // transparent wrappers hide what they are made of from the chain
    match error.downcast_ref::<TradeError>() {
        Some(TradeError::Output(error)) => return of_one(error),
        Some(TradeError::Stopped(_)) => return Some(Exit::Cancelled),
        _ => {}
    }
    match error.downcast_ref() {
        Some(OutputError::File { fault, .. }) => return fault.io_kind().and_then(of_io),
        Some(OutputError::Mismatch { .. }) => return Some(Exit::Fault),
        None => {}
    }
    if let Some(ServeError::Fault(_)) = error.downcast_ref() {
        return Some(Exit::Fault);
    }
    if error.is::<MissedTarget>() {
        return Some(Exit::Missed);
    }
    if error.is::<Stopped>() {
        return Some(Exit::Cancelled);
    }
    if error.is::<SeriesMemory>() {
        return Some(Exit::Limit);
    }
    let no_threads = error.is::<ThreadPoolBuildError>()
        || matches!(
            error.downcast_ref(),
            Some(DoorError::Threads(_) | DoorError::Runtime(_))
        );
    no_threads.then_some(Exit::Limit)
}

fn of_kind(kind: FailureKind) -> Exit {
    match kind {
        FailureKind::Input => Exit::Input,
        FailureKind::Limit => Exit::Limit,
        FailureKind::Fault => Exit::Fault,
        FailureKind::Cancelled => Exit::Cancelled,
    }
}

fn of_remote(error: &RemoteError) -> Exit {
    match error {
        RemoteError::Refused { kind, .. } => of_refusal(*kind),
        RemoteError::Busy { .. } => Exit::Limit,
        RemoteError::Lost { .. } | RemoteError::Credentials { .. } => Exit::Master,
        RemoteError::Failed { kind, .. } => of_kind(*kind),
        RemoteError::Cancelled => Exit::Cancelled,
        RemoteError::Answer(_) => Exit::Fault,
    }
}

fn of_refusal(kind: RefusalKind) -> Exit {
    match kind {
        RefusalKind::Input => Exit::Input,
        RefusalKind::Limit => Exit::Limit,
        RefusalKind::Master => Exit::Master,
    }
}

/// What the system does not allow for lack of room; all else is said of a file, which is input.
fn of_io(kind: io::ErrorKind) -> Option<Exit> {
    use io::ErrorKind::{FileTooLarge, OutOfMemory, QuotaExceeded, StorageFull};
    let is_full = matches!(
        kind,
        StorageFull | QuotaExceeded | FileTooLarge | OutOfMemory
    );
    is_full.then_some(Exit::Limit)
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;
    use nestrad_engine::plan::PlanError;

    use super::*;

    #[test]
    fn every_kind_of_end_has_its_code() {
        let remote = |kind| RemoteError::Failed {
            reason: "out of paper".into(),
            kind,
        };
        let refused = |code| RemoteError::Refused {
            doing: "take the scene",
            message: String::new(),
            kind: RefusalKind::of(code),
        };
        let full = io::Error::from(io::ErrorKind::StorageFull);
        let elements = PlanError::Elements { found: 2, most: 1 };
        let accuracy = PlanError::Accuracy {
            least: 0.01,
            found: 0.0,
        };
        let unbalanced = SolveError::Unbalanced {
            band: "PAR".into(),
            missing: 1.0,
            stated: 0.0,
        };
        let missed = MissedTarget {
            asked_percent: 0.3,
            reached_percent: Some(0.95),
            fault: "out of paper".into(),
            place: "out".into(),
        };
        let status = tonic::Status::unavailable("");
        let unanswered = Unanswered {
            master: String::new(),
            status,
        };
        for (error, code) in [
            (anyhow!("no such file"), 1),
            (RoundsError::from(accuracy).into(), 1),
            (missed.into(), 3),
            (RoundsError::from(elements).into(), 4),
            (anyhow::Error::from(full).context("cannot write out"), 4),
            (
                anyhow::Error::from(remote(FailureKind::Limit)).context("master"),
                4,
            ),
            (refused(tonic::Code::ResourceExhausted).into(), 4),
            (refused(tonic::Code::InvalidArgument).into(), 1),
            (refused(tonic::Code::Unauthenticated).into(), 5),
            (unanswered.into(), 5),
            (RoundsError::from(unbalanced).into(), 6),
            (remote(FailureKind::Fault).into(), 6),
            (RoundsError::from(SolveError::from(Stopped)).into(), 130),
            (RemoteError::Cancelled.into(), 130),
        ] {
            assert_eq!(of(&error) as u8, code, "{error:#}");
        }
    }

    #[test]
    fn a_missed_target_says_what_was_asked_what_was_reached_and_why() {
        let missed = MissedTarget {
            asked_percent: 0.3,
            reached_percent: Some(0.953),
            fault: "out of paper".into(),
            place: "out/".into(),
        };
        assert_eq!(
            missed.to_string(),
            "the target error of 0.3 % was missed, because a finer round failed: out of paper; out/ has the results \
             of the round before, with 0.95 %"
        );
    }
}
