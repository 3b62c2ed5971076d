//! Sizes: from slivers to sheets, side by side.

use glam::{DVec2, DVec3};
use nestrad_common::optics::LeafOptics;
use nestrad_engine::plan::Estimator;

use super::{AXIS, SUN, by, flat, lit};
use crate::adding::stack;
use crate::extremes::judge::{all, changed, coarse, near, solved, within_se};
use crate::extremes::{Case, Verdict};
use crate::scenery::Scenery;
use crate::solving::{ESTIMATORS, shares};

/// Black triangles in full sun, next to each other: each takes all that falls on it.
fn each_takes_its_own(triangles: &[[DVec3; 3]]) -> Verdict {
    let mut scenery = Scenery::open();
    for (k, triangle) in triangles.iter().enumerate() {
        scenery.triangle(&format!("leaf {k}"), *triangle);
    }
    let solution = solved(&lit(scenery, LeafOptics::default(), 0.0), &coarse())?.solution;
    let last = solution.organs.len() - 1;
    all((0..=last).rev().map(|k| {
        let item = &solution.organs[k];
        let power = SUN * solution.organ_area_m2[k];
        // an error of nothing of something that is not known would be a lie
        if item.absorbed_se_W == 0.0 && (item.absorbed_W - power).abs() > 1e-12 * power {
            return Err(format!("{} W ± 0, expected {power} W", item.absorbed_W));
        }
        within_se("power/W", item.absorbed_W, power, item.absorbed_se_W)
    }))
}

/// A small grey triangle a millimetre above a grey plate in the sun: its lower face sees the lit plate
/// and nothing else.
fn lower_face_sees_the_plate(small: [DVec3; 3], plate_m: f64, estimator: Estimator) -> Verdict {
    let rho = 0.3;
    let mut scenery = Scenery::open();
    scenery.triangle("leaf 1", small);
    let corner = DVec3::new(-0.5, -0.5, -1e-3 / plate_m) * plate_m;
    scenery.level("leaf 2", corner, DVec2::splat(plate_m));
    let scene = lit(scenery, LeafOptics::symmetric(rho, 0.0), 0.0);
    let item = solved(&scene, &by(estimator))?.solution.organs[0];
    near("lower/upper", item.irradiance_lower_W_m2 / SUN, rho, 0.05)
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = vec![
        Case::new(
            AXIS,
            "one triangle",
            "black, in full sun: takes I A",
            || each_takes_its_own(&[flat(DVec3::ZERO, DVec2::ONE)]),
        ),
        Case::new(
            AXIS,
            "1e-14 m² to 1e6 m² side by side",
            "black, in full sun: each takes I A within its stated error",
            || {
                each_takes_its_own(&[
                    flat(DVec3::ZERO, DVec2::splat(2f64.sqrt() * 1e3)),
                    flat(DVec3::X * -1.0, DVec2::splat(1e-2)),
                    flat(DVec3::X * -1.5, DVec2::splat(1e-4)),
                    flat(DVec3::X * -2.0, DVec2::splat(2f64.sqrt() * 1e-7)),
                ])
            },
        ),
        Case::new(
            AXIS,
            "a leaf of 1e-8 m² alone on a pattern of 1 m²",
            "black, in full sun: takes I A within its stated error",
            || {
                let mut scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
                scenery.triangle("leaf 1", flat(DVec3::Z, DVec2::splat(1e-4)));
                let solution =
                    solved(&lit(scenery, LeafOptics::default(), 0.0), &coarse())?.solution;
                let item = &solution.organs[0];
                within_se("power/W", item.absorbed_W, SUN * 5e-9, item.absorbed_se_W)
            },
        ),
        Case::new(
            AXIS,
            "needle, 1 m by 1 µm, beside a leaf",
            "black, in full sun: takes I A within its stated error",
            || {
                each_takes_its_own(&[
                    flat(DVec3::ZERO, DVec2::splat(0.3)),
                    flat(DVec3::Y * -0.1, DVec2::new(1.0, 1e-6)),
                ])
            },
        ),
        Case::new(
            AXIS,
            "100 needles, 1 m by 1 µm",
            "a needle is not cut into thousands of elements: solved in little memory",
            || {
                let mut scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
                for k in 0..100 {
                    let at = DVec3::new(0.0, 1e-2 * f64::from(k), 0.5);
                    scenery.triangle(&format!("leaf {k}"), flat(at, DVec2::new(1.0, 1e-6)));
                }
                let scene = lit(scenery, LeafOptics::symmetric(0.4, 0.4), 0.2);
                let solved = solved(&scene, &coarse())?;
                let elements = solved.work.elements;
                if elements > 200_000 {
                    return Err(format!("{elements} elements"));
                }
                near("albedo", shares(&solved.solution, 0).up, 0.2, 1e-3)
            },
        ),
        Case::new(
            AXIS,
            "a line: three corners in a row",
            "no area, no light; the plate below keeps its own",
            || {
                let mut scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
                let line = [
                    DVec3::Z,
                    DVec3::new(0.3, 0.1, 1.0),
                    DVec3::new(0.9, 0.3, 1.0),
                ];
                scenery.triangle("leaf 1", line);
                scenery.level("leaf 2", DVec3::Z * 0.5, DVec2::ONE);
                let scene = lit(scenery, LeafOptics::symmetric(0.4, 0.4), 0.2);
                let solution = changed(&scene, &coarse(), |p| p.trace.max_edge_m = 0.1)?.solution;
                let albedo = stack(1, LeafOptics::symmetric(0.4, 0.4), 0.2).albedo;
                all([
                    near("albedo", shares(&solution, 0).up, albedo, 1e-3),
                    near("line", solution.organs[0].absorbed_W, 0.0, 1e-9),
                ])
            },
        ),
    ];
    for estimator in ESTIMATORS {
        cases.push(Case::new(
            AXIS,
            format!("1e-14 m² a millimetre above 1e6 m², {estimator:?}"),
            "its lower face sees the lit plate alone: rho times the sun",
            move || {
                let small = flat(DVec3::ZERO, DVec2::splat(2f64.sqrt() * 1e-7));
                lower_face_sees_the_plate(small, 1e3, estimator)
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("needle, 0.2 m by 0.2 µm, a millimetre above 1 m², {estimator:?}"),
            "its lower face sees the lit plate alone: rho times the sun",
            move || {
                let small = flat(DVec3::new(-0.1, 0.0, 0.0), DVec2::new(0.2, 2e-7));
                lower_face_sees_the_plate(small, 1.0, estimator)
            },
        ));
    }
    cases
}
