//! How large the errors of a result are thought to be, in one number per band.

use nestrad_common::scene::Scene;
use serde::Serialize;

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

/// One per band. Soil triangles do not count.
pub fn organ_errors(scene: &Scene, solution: &Solution) -> Vec<OrganErrors> {
    let bands = solution.balance.len();
    let mut plant = vec![true; scene.organs.len()];
    for (&organ, soil) in scene.organ.iter().zip(is_soil(scene)) {
        plant[organ as usize] &= !soil;
    }
    let rms_percent = |band: usize| {
        let (mut area_m2, mut absorbed_W, mut square) = (0.0, 0.0, 0.0);
        for (organ, &own_m2) in solution.organ_area_m2.iter().enumerate() {
            if plant[organ] && own_m2 > 0.0 {
                let light = &solution.organs[organ * bands + band];
                area_m2 += own_m2;
                absorbed_W += light.absorbed_W;
                square += light.absorbed_se_W * light.absorbed_se_W / own_m2;
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
