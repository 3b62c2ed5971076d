//! How large the errors of a result are thought to be, in one number per band.

use nestrad_common::scene::Scene;
use serde::{Deserialize, Serialize};

use crate::solution::Solution;
use crate::world::is_soil;

/// What the standard errors of a band's organs come to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OrganErrors {
    /// Name of the band.
    pub band: String,
    /// Standard error of an organ's absorbed power per area, root mean square over the plants' area,
    /// in percent of the mean over that area; none where nothing is absorbed.
    pub rms_percent: Option<f64>,
}

/// What the error of a band's organs comes from: each as the root mean square of [`OrganErrors`], percent.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
pub struct ErrorParts {
    /// Name of the band.
    pub band: String,
    /// Sampling of the exchange and of the far field.
    pub exchange_percent: f64,
    /// Sampling of the direct light.
    pub direct_percent: f64,
    /// What the solver left undone, at most; the whole of it, not of an organ.
    pub solver_percent: f64,
}

impl ErrorParts {
    /// All of it: samples are independent, what the solver left is not an error of sampling.
    pub fn total_percent(&self) -> f64 {
        self.exchange_percent.hypot(self.direct_percent) + self.solver_percent
    }

    /// The name of the largest part.
    pub fn largest(&self) -> &'static str {
        let parts = [
            (self.exchange_percent, "the exchange between leaves"),
            (self.direct_percent, "the direct light"),
            (self.solver_percent, "the solver"),
        ];
        parts
            .iter()
            .fold(parts[0], |a, &b| if b.0 > a.0 { b } else { a })
            .1
    }
}

/// One per band in which something is absorbed, from the variances of the direct light of organs, W², indexed like the solution's organs, and
/// what the solver left of the incoming light in each band.
pub(crate) fn error_parts(
    scene: &Scene,
    solution: &Solution,
    direct_W2: &[f64],
    left: impl Fn(usize) -> f64,
) -> Vec<ErrorParts> {
    let all = organ_errors(scene, solution);
    let direct = rms_of(scene, solution, |item| direct_W2[item]);
    let bands = all
        .into_iter()
        .zip(direct)
        .zip(&solution.balance)
        .enumerate();
    bands
        .filter_map(|(band, ((all, direct), balance))| {
            let (all_percent, direct_percent) = (all.rms_percent?, direct.rms_percent?);
            let exchange_square = all_percent.powi(2) - direct_percent.powi(2);
            let left_W = left(band) * balance.incoming_W;
            Some(ErrorParts {
                band: all.band,
                exchange_percent: exchange_square.max(0.0).sqrt(),
                direct_percent,
                solver_percent: 100.0 * left_W / balance.absorbed_plants_W.value,
            })
        })
        .collect()
}

/// One per band. Soil triangles do not count.
pub fn organ_errors(scene: &Scene, solution: &Solution) -> Vec<OrganErrors> {
    rms_of(scene, solution, |item| {
        solution.organs[item].absorbed_se_W.powi(2)
    })
}

/// The same of some variances, in W², indexed like the solution's organs.
pub(crate) fn rms_of(
    scene: &Scene,
    solution: &Solution,
    variance_W2: impl Fn(usize) -> f64,
) -> Vec<OrganErrors> {
    let bands = solution.balance.len();
    let mut plant = vec![true; scene.organs.len()];
    for (&organ, soil) in scene.organ.iter().zip(is_soil(scene)) {
        plant[organ as usize] &= !soil;
    }
    let rms_percent = |band: usize| {
        let (mut area_m2, mut absorbed_W, mut square) = (0.0, 0.0, 0.0);
        for (organ, &own_m2) in solution.organ_area_m2.iter().enumerate() {
            if plant[organ] && own_m2 > 0.0 {
                let item = organ * bands + band;
                area_m2 += own_m2;
                absorbed_W += solution.organs[item].absorbed_W;
                square += variance_W2(item) / own_m2;
            }
        }
        (absorbed_W > 0.0).then(|| 100.0 * (square * area_m2).sqrt() / absorbed_W)
    };
    let names = solution.balance.iter().map(|balance| &balance.band);
    names
        .enumerate()
        .map(|(band, name)| OrganErrors {
            band: name.clone(),
            rms_percent: rms_percent(band),
        })
        .collect()
}
