//! Where the world ends: the soil, the rim of the pattern, planes along the light.

use glam::{DVec2, DVec3};
use nestrad_common::optics::LeafOptics;
use nestrad_engine::plan::Estimator;
use nestrad_engine::solution::ItemLight;

use super::{AXIS, SUN, by, flat, lit};
use crate::adding::{plates, stack};
use crate::extremes::judge::{all, changed, coarse, near, refused, solved, within_se};
use crate::extremes::{Case, Verdict};
use crate::scenery::{Scenery, from_zenith};
use crate::solving::{ESTIMATORS, shares};

/// The organs of a scene in which a sheet stands from `bottom_m` to 0.3 m above the soil at 0.
fn standing(bottom_m: f64, x_m: f64, estimator: Estimator) -> Result<ItemLight, String> {
    let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
    let at = |y: f64, z: f64| DVec3::new(x_m, y, z);
    scenery.quad(
        "leaf 1",
        [
            at(0.1, bottom_m),
            at(0.3, bottom_m),
            at(0.3, 0.3),
            at(0.1, 0.3),
        ],
    );
    scenery.band("B", 0.5, &[("leaf", LeafOptics::symmetric(0.4, 0.3))]);
    scenery.source(from_zenith(45.0, 0.0), SUN);
    scenery.source(from_zenith(30.0, 180.0), SUN);
    let scene = scenery.scene();
    let solved = changed(&scene, &by(estimator), |p| p.trace.max_edge_m = 0.05)?;
    Ok(solved.solution.organs[0])
}

fn same_power(a: ItemLight, b: ItemLight) -> Verdict {
    let se = a.absorbed_se_W.hypot(b.absorbed_se_W);
    within_se("power/W", a.absorbed_W, b.absorbed_W, se)
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for estimator in ESTIMATORS {
        cases.push(Case::new(
            AXIS,
            format!("a standing leaf half in the soil, {estimator:?}"),
            "takes what the half above the soil takes alone",
            move || {
                same_power(
                    standing(-0.3, 0.2, estimator)?,
                    standing(0.0, 0.2, estimator)?,
                )
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("a standing leaf exactly on the pattern's edge, {estimator:?}"),
            "takes what it takes in the middle",
            move || {
                same_power(
                    standing(0.1, 0.0, estimator)?,
                    standing(0.1, 0.3, estimator)?,
                )
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("the same on the far edge, {estimator:?}"),
            "takes what it takes in the middle",
            move || {
                same_power(
                    standing(0.1, 0.6, estimator)?,
                    standing(0.1, 0.3, estimator)?,
                )
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("a plate exactly on the soil, {estimator:?}"),
            "adding of 1 plate",
            move || {
                let leaf = LeafOptics::symmetric(0.4, 0.5);
                let scenery = plates(1, 0.1, leaf, 0.6).soil(0.1);
                let solution = changed(&scenery.scene(), &by(estimator), |plan| {
                    (plan.trace.max_edge_m, plan.light.direct_line_area_m2) = (0.1, 5e-6);
                })?
                .solution;
                near(
                    "albedo",
                    shares(&solution, 0).up,
                    stack(1, leaf, 0.6).albedo,
                    1e-3,
                )
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("a plate of three by two patterns, {estimator:?}"),
            "white: albedo 1",
            move || {
                let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
                scenery.level("leaf 1", DVec3::new(-0.5, -0.3, 0.3), DVec2::new(1.8, 0.8));
                let scene = lit(scenery, LeafOptics::symmetric(0.5, 0.5), 1.0);
                let solution =
                    changed(&scene, &by(estimator), |p| p.trace.max_edge_m = 0.2)?.solution;
                let (up, closure) = (
                    solution.balance[0].escaped_up_W,
                    solution.balance[0].closure_W,
                );
                within_se("up/W", up.value, solution.balance[0].incoming_W, closure.se)
            },
        ));
    }
    cases.push(Case::new(
        AXIS,
        "a slanted black leaf of 100 patterns",
        "lets nothing through",
        || {
            let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
            let at = |x: f64, y: f64| DVec3::new(x, y, 1.0 + 0.1 * x);
            scenery.quad("leaf 1", [at(0., 0.), at(6., 0.), at(6., 4.), at(0., 4.)]);
            let solution = solved(&lit(scenery, LeafOptics::default(), 0.5), &coarse())?.solution;
            near("absorbed", shares(&solution, 0).plants, 1.0, 1e-9)
        },
    ));
    for size_m in [1e4, 1e9] {
        cases.push(Case::new(
            AXIS,
            format!("a triangle of {size_m:e} m on a pattern of 1 m"),
            "refused: the triangle reaches over too many patterns",
            move || {
                let mut scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
                scenery.triangle("leaf 1", flat(DVec3::Z, DVec2::splat(size_m)));
                let scene = lit(scenery, LeafOptics::default(), 0.5);
                refused(solved(&scene, &coarse()), &["pattern"])
            },
        ));
    }
    cases.push(Case::new(
        AXIS,
        "exactly vertical under the zenith, alone",
        "no light falls on it: none is absorbed, and nothing is divided by it",
        || {
            let mut scenery = Scenery::open();
            scenery.triangle("leaf 1", [DVec3::ZERO, DVec3::X, DVec3::Z]);
            let solution = solved(
                &lit(scenery, LeafOptics::symmetric(0.4, 0.4), 0.0),
                &coarse(),
            )?;
            near("power/W", solution.solution.organs[0].absorbed_W, 0.0, 0.0)
        },
    ));
    cases.push(Case::new(
        AXIS,
        "exactly along the sun, slanted, over soil",
        "no light falls on it from the sun; what the soil sends is shared as for a leaf turned by 1e-9",
        || {
            let along = |turn: f64| {
                let mut scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
                let d = from_zenith(40.0, 0.0);
                let side = DVec3::Y * 0.5 + DVec3::X * turn;
                let foot = DVec3::new(0.5, 0.2, 0.1);
                scenery.triangle("leaf 1", [foot, foot - d * 0.5, foot + side]);
                scenery.band("B", 0.5, &[("leaf", LeafOptics::symmetric(0.4, 0.4))]);
                scenery.source(d, SUN);
                solved(&scenery.scene(), &coarse()).map(|f| f.solution.organs[0])
            };
            let (exact, near_it) = (along(0.0)?, along(1e-9)?);
            all([
                same_power(exact, near_it),
                near("direct", exact.absorbed_direct_W, 0.0, 1e-6),
            ])
        },
    ));
    cases
}
