//! What was asked for, what came of it, and the sentence that says so.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::MOST_ROUNDS;
use crate::plan::Aims;
use crate::solution::BandAccount;

/// What was asked for, and what came of it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct Accuracy {
    /// Error that was asked for: of the worst band, rms over organs, percent of the mean.
    pub asked_percent: f64,
    /// Why there was no further round.
    pub ended: Ended,
    /// All rounds.
    pub rounds: Vec<Round>,
    /// What the error of the last one comes from, by band.
    pub errors: Vec<BandAccount>,
    /// Why a finer round failed, where one did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
}

/// A round.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize)]
pub struct Round {
    /// What its parts were planned for.
    pub planned: Aims,
    /// Error of its worst band, by its own account; none where nothing is absorbed.
    pub reached_percent: Option<f64>,
}

/// Why there was no further round.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// The error is what was asked for, or less.
    Reached,
    /// A finer one would have taken longer than allowed.
    OutOfTime,
    /// A finer one would have taken more memory, or more lines, than there may be.
    BeyondLimits,
    /// There have been enough.
    OutOfRounds,
    /// No plan reduces the rest of the error: it is of the mean field beyond the sphere, of sky directions that
    /// were given, or of parts that are at their finest.
    NoFiner,
    /// A finer one failed.
    Failed,
    /// No accuracy was asked for: one round for the default is all.
    NotAsked,
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(worst) = worst(&self.errors) else {
            return f.write_str("nothing is absorbed, so there is no error");
        };
        let target = self.asked_percent;
        let (is_met, reached) = met(worst.total_percent(), target);
        let said = if is_met { "met" } else { "missed" };
        write!(f, "target {target} % {said} ({reached} % reached)")?;
        match self.ended {
            Ended::Reached => {}
            Ended::OutOfTime => f.write_str("; --budget leaves no time for a finer round")?,
            Ended::BeyondLimits => f.write_str(
                "; a finer round needs more memory than --memory allows, or more elements than nestrad can number",
            )?,
            Ended::OutOfRounds => write!(f, "; nestrad stops after {MOST_ROUNDS} rounds")?,
            Ended::NoFiner => f.write_str("; a finer round would not reduce the error")?,
            Ended::Failed => {
                let cause = self.failure.as_deref().unwrap_or("the cause is not known");
                write!(f, "; a finer round failed: {cause}")?;
            }
            Ended::NotAsked => write!(f, "; add --accuracy {target} to refine")?,
        }
        let mut parts = worst.named();
        parts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let parts = parts.iter().filter(|(percent, _)| *percent > 0.0);
        let parts: Vec<String> = parts
            .map(|(percent, name)| format!("{name} {percent:.2} %"))
            .collect();
        let band = &worst.band;
        match &parts[..] {
            [] => Ok(()),
            parts => write!(
                f,
                "; error in {band}, largest part first: {}",
                parts.join(", ")
            ),
        }
    }
}

/// The band with the largest error.
pub(super) fn worst(errors: &[BandAccount]) -> Option<&BandAccount> {
    let by_total =
        |a: &&BandAccount, b: &&BandAccount| a.total_percent().total_cmp(&b.total_percent());
    errors.iter().max_by(by_total)
}

/// Whether an error is at most the target, and the error in as many decimals as show it.
fn met(reached_percent: f64, target_percent: f64) -> (bool, String) {
    let is_met = reached_percent <= target_percent;
    let shown = (2..8).map(|decimals| format!("{reached_percent:.decimals$}"));
    let agrees = |text: &String| {
        text.parse()
            .is_ok_and(|shown: f64| (shown <= target_percent) == is_met)
    };
    let exact = || reached_percent.to_string();
    (is_met, shown.into_iter().find(agrees).unwrap_or_else(exact))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(ended: Ended, exchange_percent: f64) -> String {
        let accuracy = Accuracy {
            asked_percent: 0.5,
            ended,
            rounds: Vec::new(),
            errors: vec![BandAccount {
                band: "PAR".into(),
                exchange_percent,
                direct_percent: 0.1,
                ..BandAccount::default()
            }],
            failure: Some("out of paper".into()),
        };
        accuracy.to_string()
    }

    #[test]
    fn fault_a_missed_target_was_a_riddle() {
        let parts = "; error in PAR, largest part first: exchange 1.40 %, direct light 0.10 %";
        for (ended, why) in [
            (Ended::NotAsked, "add --accuracy 0.5 to refine"),
            (
                Ended::OutOfTime,
                "--budget leaves no time for a finer round",
            ),
            (Ended::OutOfRounds, "nestrad stops after 5 rounds"),
            (Ended::NoFiner, "a finer round would not reduce the error"),
            (Ended::Failed, "a finer round failed: out of paper"),
        ] {
            let expected = format!("target 0.5 % missed (1.40 % reached); {why}{parts}");
            assert_eq!(said(ended, 1.4), expected);
        }
        let parts = "; error in PAR, largest part first: exchange 0.30 %, direct light 0.10 %";
        let expected = format!("target 0.5 % met (0.32 % reached){parts}");
        assert_eq!(said(Ended::Reached, 0.3), expected);
    }

    #[test]
    fn an_error_that_misses_narrowly_is_shown_to_miss() {
        assert_eq!(met(0.5002, 0.5), (false, "0.5002".to_owned()));
        assert_eq!(met(0.4999, 0.5), (true, "0.50".to_owned()));
        assert_eq!(met(0.5, 0.5), (true, "0.50".to_owned()));
        assert_eq!(met(0.004, 0.003), (false, "0.004".to_owned()));
    }

    #[test]
    fn the_band_with_the_largest_error_counts() {
        let of = |exchange_percent| BandAccount {
            exchange_percent,
            ..BandAccount::default()
        };
        assert_eq!(worst(&[of(0.1), of(0.3)]), Some(&of(0.3)));
        assert_eq!(worst(&[]), None);
    }
}
