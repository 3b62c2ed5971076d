//! What is kept of a moment: the light of organs and the balance.

use nestrad_engine::solution::{Balance, BandAccount, Solution};
use serde::{Deserialize, Serialize};

/// What an organ absorbs in a band.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrganStep {
    /// By both faces, W.
    pub absorbed_W: f64,
    /// The part of it that came straight from the sources, W.
    pub absorbed_direct_W: f64,
    /// Standard error of `absorbed_W`, W.
    pub absorbed_se_W: f64,
    /// How far it may be off besides, W.
    pub absorbed_bias_W: f64,
}

/// The rest of what is kept of a moment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepFacts {
    /// One per band.
    pub balance: Vec<Balance>,
    /// The error of organs in the worst band, percent; none where nothing is absorbed.
    pub error_percent: Option<f64>,
}

/// A moment with light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepResult {
    /// Indexed `organ * bands + band`.
    pub organs: Vec<OrganStep>,
    /// Balance and error.
    pub facts: StepFacts,
}

impl StepResult {
    /// What is kept of a solution.
    pub fn of(solution: &Solution) -> Self {
        let organs = solution.organs.iter().zip(&solution.organ_bias_W);
        let organs = organs.map(|(light, &absorbed_bias_W)| OrganStep {
            absorbed_W: light.absorbed_W,
            absorbed_direct_W: light.absorbed_direct_W,
            absorbed_se_W: light.absorbed_se_W,
            absorbed_bias_W,
        });
        Self {
            organs: organs.collect(),
            facts: StepFacts {
                balance: solution.balance.clone(),
                error_percent: solution
                    .account
                    .iter()
                    .map(BandAccount::total_percent)
                    .reduce(f64::max),
            },
        }
    }

    /// Bytes that so many organs take in so many bands.
    pub fn bytes(organs: usize, bands: usize) -> u64 {
        (organs * bands * size_of::<OrganStep>() + bands * size_of::<Balance>()) as u64
    }
}
