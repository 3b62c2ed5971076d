//! How a client ended: with the right bytes, with an error that names its cause, or wrongly.

use std::fmt;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::ExitStatus;
use std::time::Instant;

use crate::scenes::Case;
use crate::trouble::{Kind, Troubles};

/// What was done to a client.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Deeds {
    pub(crate) killed: bool,
    pub(crate) interrupted: bool,
    pub(crate) paused: bool,
    pub(crate) full_disk: bool,
    /// Nobody read what it said.
    pub(crate) unheard: bool,
}

/// A process of a client that has ended.
pub(crate) struct Solved {
    pub(crate) client: usize,
    pub(crate) begun: Instant,
    /// `None` where it did not end in time.
    pub(crate) status: Option<ExitStatus>,
    /// On stderr.
    pub(crate) said: String,
    pub(crate) out: PathBuf,
    pub(crate) deeds: Deeds,
}

/// How it ended.
pub(crate) enum End {
    Right,
    /// It was killed, and left nothing that passes for a result.
    Killed,
    /// The exit code, the message, and whether the message fits something that was wrong.
    Error(i32, String, bool),
    Hangs,
    Wrong(String),
}

/// Exit codes of `nestrad solve` that an error has here (`master/docs/operators.md`).
const CODES: [i32; 6] = [1, 3, 4, 5, 6, 130];

impl Solved {
    /// What it said besides the plan and remarks on the scene.
    pub(crate) fn essence(&self) -> String {
        let usual = |line: &&str| !["plan: ", "warning: "].iter().any(|w| line.starts_with(w));
        let lines: Vec<_> = self.said.lines().filter(usual).collect();
        lines.join("\n")
    }

    pub(crate) fn judge(&self, case: &Case, troubles: &Troubles) -> End {
        let end = self.end(case, troubles);
        self.clear();
        end
    }

    fn end(&self, case: &Case, troubles: &Troubles) -> End {
        let Some(status) = self.status else {
            return End::Hangs;
        };
        let is_sealed = self.out.join("summary.json").exists();
        if self.deeds.killed && status.signal() == Some(9) {
            return match case.compare(&self.out) {
                Err(fault) if is_sealed => End::Wrong(format!("sealed when killed, and {fault}")),
                _ => End::Killed,
            };
        }
        match status.code() {
            Some(0) => case
                .compare(&self.out)
                .map_or_else(End::Wrong, |()| End::Right),
            Some(code) => self.error(code, is_sealed, troubles),
            None => End::Wrong(format!("{status}")),
        }
    }

    fn error(&self, code: i32, is_sealed: bool, troubles: &Troubles) -> End {
        if !CODES.contains(&code) {
            return End::Wrong(format!("exit code {code}"));
        }
        // results stand only where an accuracy was missed, which is said
        if is_sealed != (code == 3) {
            let what = if is_sealed { "with" } else { "without" };
            return End::Wrong(format!("exit code {code} {what} results"));
        }
        let said = self.said.trim_end();
        let message = said.lines().last().unwrap_or_default().to_owned();
        if self.deeds.unheard {
            return End::Error(code, "(nobody read the message)".to_owned(), true);
        }
        if !message.starts_with("error: ") && code != 3 {
            return End::Wrong(format!("exit code {code} without a message"));
        }
        if said.chars().any(|c| c.is_control() && c != '\n') {
            return End::Wrong(format!("control characters in {message:?}"));
        }
        let fits = self.fits(&message, troubles);
        End::Error(code, message, fits)
    }

    /// Whether what was wrong meanwhile explains a message.
    fn fits(&self, message: &str, troubles: &Troubles) -> bool {
        let says = |text: &str| message.contains(text);
        let was = |kind| troubles.within(kind, self.begun);
        let away = was(Kind::MasterKilled)
            || was(Kind::MasterTerminated)
            || was(Kind::MasterPaused)
            || was(Kind::Way(self.client))
            || self.deeds.paused;
        (says("cannot write") && self.deeds.full_disk)
            || (says("cancelled") && (self.deeds.interrupted || was(Kind::MasterTerminated)))
            || ((says("reached") || says("next slice")) && away)
            || (says("about to stop") && was(Kind::MasterTerminated))
    }
}

impl End {
    /// As it is counted.
    pub(crate) fn kind(&self) -> String {
        match self {
            Self::Right => "the right bytes".to_owned(),
            Self::Killed => "killed".to_owned(),
            Self::Error(code, message, _) => {
                format!("exit code {code}: {}", without_names(message))
            }
            Self::Hangs => "HANGS".to_owned(),
            Self::Wrong(_) => "WRONG".to_owned(),
        }
    }

    /// What must hold of every end, and whether it does.
    pub(crate) fn checks(&self) -> [(&'static str, bool); 3] {
        [
            (
                "a client has the right bytes or a documented error",
                !matches!(self, Self::Wrong(_)),
            ),
            (
                "a client ends within its time",
                !matches!(self, Self::Hangs),
            ),
            (
                "an error has a cause among the faults",
                !matches!(self, Self::Error(_, _, false)),
            ),
        ]
    }
}

/// A message without what differs from one client to the next: paths, addresses, numbers.
fn without_names(message: &str) -> String {
    let words = message.split(' ').map(|word| {
        let named = word.contains('/') || word.chars().any(|c| c.is_ascii_digit());
        if named { "..." } else { word }
    });
    words.collect::<Vec<_>>().join(" ")
}

impl fmt::Display for End {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Right => f.write_str("the right bytes"),
            Self::Killed => f.write_str("killed"),
            Self::Error(code, message, _) => write!(f, "exit code {code}: {message}"),
            Self::Hangs => f.write_str("HANGS"),
            Self::Wrong(what) => write!(f, "WRONG: {what}"),
        }
    }
}
