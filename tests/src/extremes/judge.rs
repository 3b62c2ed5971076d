//! How cases are solved and judged.

use std::fmt::Display;
use std::path::Path;

use nestrad_common::assemble::load;
use nestrad_common::inputs::Inputs;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::{Plan, Settings};
use nestrad_engine::solution::Solution;

use super::{Seen, Verdict};
use crate::solving::{Solved, finish, try_plan};

/// Small scenes need no more.
pub(super) fn coarse() -> Settings {
    Settings {
        accuracy_percent: 5.0,
        ..Settings::default()
    }
}

/// Plans and solves as a user's call would; what is solved must be sound.
pub(super) fn solved(scene: &Scene, settings: &Settings) -> Result<Solved, String> {
    changed(scene, settings, |_| {})
}

/// The same with a plan that was changed.
pub(super) fn changed(
    scene: &Scene,
    settings: &Settings,
    change: impl FnOnce(&mut Plan),
) -> Result<Solved, String> {
    let mut plan = try_plan(scene, settings).map_err(refusal)?;
    change(&mut plan);
    let solved = finish(scene, &plan).map_err(refusal)?;
    sound(&solved.solution, plan.light.tolerance.absorbed)?;
    Ok(solved)
}

/// An error with all its causes.
pub fn refusal(error: impl std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        text = format!("{text}: {error}");
        cause = error.source();
    }
    text
}

/// Reads files; only the message of a refusal is of interest, or the scene.
pub(super) fn loaded(inputs: &Inputs, folder: &Path) -> Result<Scene, String> {
    let here = format!("{}/", folder.display());
    load(inputs)
        .map(|loaded| loaded.scene)
        .map_err(|error| refusal(error).replace(&here, ""))
}

/// What must hold of any solution.
pub fn sound(solution: &Solution, tolerance: f64) -> Result<(), String> {
    let bands = solution.balance.len();
    let finite = |what: &str, value: f64| {
        if value.is_finite() && value >= 0.0 {
            Ok(())
        } else {
            Err(format!("{what} is {value}"))
        }
    };
    for item in solution.organs.iter().chain(&solution.triangles) {
        finite("irradiance", item.irradiance_upper_W_m2)?;
        finite("irradiance", item.irradiance_lower_W_m2)?;
        finite("absorbed power", item.absorbed_W)?;
        finite("direct power", item.absorbed_direct_W)?;
        finite("standard error", item.absorbed_se_W)?;
    }
    for cell in solution.soil.iter().flat_map(|map| &map.irradiance_W_m2) {
        finite("irradiance of the soil", cell.value)?;
        finite("standard error of the soil", cell.se)?;
    }
    for (b, balance) in solution.balance.iter().enumerate() {
        finite("incoming power", balance.incoming_W)?;
        let organs: f64 = (b..solution.organs.len())
            .step_by(bands)
            .map(|k| solution.organs[k].absorbed_W)
            .sum();
        let all = balance.incoming_W * (1.0 + 10.0 * tolerance);
        if organs > all + 4.0 * balance.absorbed_plants_W.se {
            return Err(format!("{organs} W absorbed of {all} W"));
        }
        for part in [
            balance.absorbed_plants_W,
            balance.absorbed_soil_W,
            balance.escaped_up_W,
            balance.escaped_down_W,
        ] {
            finite("part of the balance", part.value)?;
            finite("standard error of the balance", part.se)?;
        }
        let (off, se) = (balance.closure_W.value, balance.closure_W.se);
        finite("standard error of the closure", se)?;
        let allowed = 5.0 * se + 10.0 * tolerance * balance.incoming_W;
        if off.is_nan() || off.abs() > allowed {
            let of = balance.incoming_W;
            return Err(format!("closure of {off:e} ± {se:e} W of {of:e} W"));
        }
    }
    Ok(())
}

/// Right if it is within `bound` of what is expected.
pub(super) fn near(what: &str, found: f64, expected: f64, bound: f64) -> Verdict {
    let figure = format!("{what} {found:.7}, off by {:.1e}", (found - expected).abs());
    if (found - expected).abs() <= bound {
        Ok(solving(figure))
    } else {
        Err(format!(
            "{figure}, expected {expected:.7} within {bound:.1e}"
        ))
    }
}

/// Right if it is within four standard errors (and the solver's own tolerance) of what is expected.
pub(super) fn within_se(what: &str, found: f64, expected: f64, se: f64) -> Verdict {
    let off = (found - expected).abs();
    let figure = format!("{what} {found:.4e} ± {se:.1e}, off by {off:.1e}");
    if off <= 4.0 * se + 1e-3 * expected.abs() + 1e-12 {
        Ok(solving(figure))
    } else {
        Err(format!("{figure}, expected {expected:.4e}"))
    }
}

/// Right because it was solved and found sound.
pub(super) fn solving(figure: impl Display) -> Seen {
    Seen {
        happens: "solved",
        figure: figure.to_string(),
    }
}

/// Right if it was refused with a message that has all these words.
pub(super) fn refused<T>(outcome: Result<T, String>, words: &[&str]) -> Verdict {
    match outcome {
        Ok(_) => Err("taken".to_owned()),
        Err(message) if words.iter().all(|word| message.contains(word)) => Ok(Seen {
            happens: "refused",
            figure: message,
        }),
        Err(message) => Err(format!("refused without {words:?}: {message}")),
    }
}

/// Right if all are; the figure is that of the first.
pub(super) fn all(verdicts: impl IntoIterator<Item = Verdict>) -> Verdict {
    let mut first = None;
    for verdict in verdicts {
        let seen = verdict?;
        first.get_or_insert(seen);
    }
    first.ok_or_else(|| "nothing was judged".to_owned())
}
