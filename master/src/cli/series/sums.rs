//! Sums over a series: where the light of each band went.

use std::fmt::Write as _;

use nestrad_engine::solution::Balance;
use nestrad_results::series::{BandSum, SeriesResult};

/// Of each band, over all moments.
pub(super) fn sums(result: &SeriesResult<'_>) -> Vec<BandSum> {
    let bands = result.bands.iter().zip(result.photon_umol_J).enumerate();
    let sum = |(band, (name, photon_umol_J)): (usize, (&&str, &Option<f64>))| {
        let over = |of: fn(&Balance) -> f64| {
            let steps = result.times.iter().zip(result.steps);
            let lit = steps.filter_map(|(time, step)| Some((time, step.as_ref()?)));
            lit.map(|(time, step)| time.weight_s * of(&step.facts.balance[band]))
                .sum()
        };
        BandSum {
            band: (*name).to_owned(),
            photon_umol_J: *photon_umol_J,
            incoming_J: over(|b| b.incoming_W),
            absorbed_plants_J: over(|b| b.absorbed_plants_W.value),
            absorbed_soil_J: over(|b| b.absorbed_soil_W.value),
            escaped_J: over(|b| b.escaped_up_W.value + b.escaped_down_W.value),
            scattered_J: over(|b| b.scattered_W.value),
            closure_J: over(|b| b.closure_W.value),
        }
    };
    bands.map(sum).collect()
}

/// Sums over time for the terminal.
pub(super) fn table(sums: &[BandSum]) -> String {
    let mut text =
        "light over the series in MJ (per pattern, or per scene without one)\n".to_owned();
    let head = ["band", "incoming", "plants", "soil", "escaped", "closure"];
    let line = |cells: [String; 6]| {
        let [band, rest @ ..] = cells;
        let rest: String = rest.iter().map(|cell| format!("{cell:>12}")).collect();
        format!("{band:<12}{rest}")
    };
    let mut add = |cells| {
        // text takes all that it is given
        let _ = writeln!(text, "{}", line(cells));
    };
    add(head.map(str::to_owned));
    for sum in sums {
        let mega = |joules: f64| format!("{:.5}", 1e-6 * joules);
        add([
            sum.band.clone(),
            mega(sum.incoming_J),
            mega(sum.absorbed_plants_J),
            mega(sum.absorbed_soil_J),
            mega(sum.escaped_J),
            mega(sum.closure_J),
        ]);
    }
    text
}
