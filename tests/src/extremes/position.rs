//! Where the scene is, and in which unit it is written: through files, as a user brings it.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use nestrad_common::light::Light;
use nestrad_common::options::Unit;
use nestrad_common::scene::Scene;
use nestrad_engine::solution::ItemLight;

use super::judge::{coarse, loaded, refused, solved, solving, within_se};
use super::{Case, Seen, Verdict};
use crate::canopies::uniform_sky;
use crate::files::Written;

const AXIS: &str = "Position and unit";

const OPTICS: [&str; 2] = [
    "n 1\ns d 0.15\ne d 0.12 d 0.09 0.05 d 0.11 0.05\n",
    "n 1\ns d 0.25\ne d 0.50 d 0.44 0.45 d 0.46 0.44\n",
];

/// Leaves of some centimetres that shade each other, at coordinates that are no whole numbers in any
/// unit.
fn leaves() -> Vec<[DVec3; 3]> {
    (0..60)
        .map(|k| {
            // the additive recurrence of the golden ratio and its like spreads points evenly
            let at = |step: f64| (f64::from(k) * step).fract();
            let place = DVec3::new(at(0.754_877), at(0.569_840), at(0.618_034));
            let foot = place * DVec3::new(0.4, 0.3, 0.25);
            let turn = TAU * at(0.414_214);
            let along = DVec3::new(turn.cos(), turn.sin(), at(0.732_051) - 0.5);
            let across = DVec3::new(-turn.sin(), turn.cos(), 0.3);
            [foot, foot + 0.08 * along, foot + 0.06 * across]
        })
        .collect()
}

fn written(
    leaves: &[[DVec3; 3]],
    unit: Unit,
    moved_m: DVec3,
    periodic: bool,
) -> Result<Scene, String> {
    let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
    let written = Written {
        leaves,
        pattern_m: periodic.then_some([0.0, 0.0, 0.4, 0.3]),
        soil_m: periodic.then_some(-0.1),
        optics: &OPTICS,
        light: "300 0.3 0.2 -1\n100 -0.5 0.1 -0.4\n",
        unit,
        moved_m,
    };
    loaded(&written.inputs(folder.path()), folder.path())
}

/// The repeating scene, with its soil at another height.
fn over_soil_at(z_m: f64) -> Result<Scene, String> {
    let mut scene = written(&leaves(), Unit::Metre, DVec3::ZERO, true)?;
    Arc::make_mut(&mut scene.canopy).soil_z_m = Some(z_m);
    Ok(scene)
}

/// The largest difference in any output of any organ, relative to its value; of stated errors a third of it.
fn farthest(a: &[ItemLight], b: &[ItemLight]) -> f64 {
    let outputs = |item: &ItemLight| {
        [
            item.irradiance_upper_W_m2,
            item.irradiance_lower_W_m2,
            item.absorbed_W,
            item.absorbed_direct_W,
            item.absorbed_se_W,
        ]
    };
    // a point more or less on an organ of a hundred changes how rough its outline looks by more than what it absorbs
    const STATED: usize = 4;
    let lenient = |k: usize, off: f64| if k == STATED { off / 3.0 } else { off };
    a.iter()
        .zip(b)
        .flat_map(|(a, b)| outputs(a).into_iter().zip(outputs(b)).enumerate())
        .map(|(k, (a, b))| lenient(k, (a - b).abs() / a.max(b).max(f64::MIN_POSITIVE)))
        .fold(0.0, f64::max)
}

/// The scene as it is against the same scene, moved and in another unit.
fn moved(unit: Unit, moved_m: DVec3, periodic: bool, bound: f64) -> Verdict {
    let leaves = leaves();
    let here = solved(
        &written(&leaves, Unit::Metre, DVec3::ZERO, periodic)?,
        &coarse(),
    )?;
    let there = solved(&written(&leaves, unit, moved_m, periodic)?, &coarse())?;
    let off = farthest(&here.solution.organs, &there.solution.organs);
    let figure = format!("farthest output of an organ off by {off:.1e} of itself");
    if off <= bound {
        Ok(solving(figure))
    } else {
        Err(format!("{figure}, expected at most {bound:.0e}"))
    }
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for (name, by, bound) in [
        ("1e3 m away", DVec3::new(1e3, -1e3, 50.0), 1e-6),
        (
            "at 5e5, 4.6e6 m (UTM), 2000 m high",
            DVec3::new(5e5, 4.6e6, 2e3),
            1e-4,
        ),
        ("1e9 m away", DVec3::new(1e9, -1e9, 0.0), 2e-2),
    ] {
        for periodic in [true, false] {
            let scene = if periodic { "repeating" } else { "alone" };
            cases.push(Case::new(
                AXIS,
                format!("{name}, {scene}"),
                format!(
                    "every output of every organ within {bound:.0e} of the scene at the origin"
                ),
                move || moved(Unit::Metre, by, periodic, bound),
            ));
        }
    }
    cases.push(Case::new(
        AXIS,
        "1e12 m away",
        "refused: there a double resolves 0.1 mm",
        || {
            let by = DVec3::new(1.1e12, 0.0, 0.0);
            let outcome = written(&leaves(), Unit::Metre, by, false);
            refused(outcome, &["scene.can, line 1", "within 1e12 of zero"])
        },
    ));
    for (name, unit) in [("cm", Unit::Centimetre), ("mm", Unit::Millimetre)] {
        cases.push(Case::new(
            AXIS,
            format!("written in {name}"),
            "every output of every organ as written in m, to rounding",
            move || moved(unit, DVec3::ZERO, true, 1e-6),
        ));
    }
    for turn_deg in [30.0, 90.0, 179.9] {
        cases.push(Case::new(
            AXIS,
            format!("turned about z by {turn_deg}°, alone, under a uniform sky"),
            "absorbs what it did",
            move || turned(turn_deg),
        ));
    }
    cases.push(Case::new(
        AXIS,
        "the soil 1e11 m below the leaves",
        "refused: heights are not resolved",
        || {
            let scene = over_soil_at(-1e11)?;
            refused(solved(&scene, &coarse()), &["height of the soil"])
        },
    ));
    cases.push(Case::new(
        AXIS,
        "the soil above all leaves",
        "leaves get no light, the soil all of it",
        || {
            let solution = solved(&over_soil_at(5.0)?, &coarse())?.solution;
            let leaves: f64 = solution.organs.iter().map(|o| o.absorbed_W).sum();
            let balance = &solution.balance[0];
            let soil = balance.absorbed_soil_W.value / balance.incoming_W;
            if leaves == 0.0 && (soil - 0.85).abs() < 1e-9 {
                Ok(solving(format!("leaves 0 W, soil {soil:.7} of the light")))
            } else {
                Err(format!("leaves {leaves} W, soil {soil} of the light"))
            }
        },
    ));
    cases
}

fn turned(turn_deg: f64) -> Verdict {
    let absorbed = |turn_deg: f64| {
        let turn = DQuat::from_rotation_z(turn_deg.to_radians());
        let leaves: Vec<_> = leaves().into_iter().map(|t| t.map(|v| turn * v)).collect();
        let mut scene = written(&leaves, Unit::Metre, DVec3::ZERO, false)?;
        // a sky of finitely many directions turns with the scene
        let mut suns = uniform_sky(64, 2);
        for source in &mut suns {
            source.direction = turn * source.direction;
        }
        scene.light = Arc::new(Light { suns, sky: None });
        Ok::<_, String>(solved(&scene, &coarse())?.solution.balance)
    };
    let (before, after) = (absorbed(0.0)?, absorbed(turn_deg)?);
    let mut figures: Vec<Seen> = Vec::new();
    for (a, b) in before.iter().zip(&after) {
        let (a, b) = (a.absorbed_plants_W, b.absorbed_plants_W);
        figures.push(within_se("power/W", b.value, a.value, a.se.hypot(b.se))?);
    }
    figures.pop().ok_or_else(|| "no band".to_owned())
}
