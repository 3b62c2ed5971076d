//! Light at its ends: how low, how many, how much.

use std::fs;

use glam::{DVec2, DVec3};
use nestrad_common::formats::light::{LightSource, parse};
use nestrad_common::optics::LeafOptics;

use super::judge::{all, changed, coarse, near, refusal, refused, solved, within_se};
use super::{Case, Verdict};
use crate::adding::{plates, stack};
use crate::canopies::uniform_sky;
use crate::scenery::{Scenery, from_zenith};
use crate::solving::shares;

const AXIS: &str = "Light";

/// Power that a black sheet in the plane x = 0.2, 0.2 m wide and 0.3 m high, on a pattern of 0.6 m by
/// 0.4 m, takes of 100 W m⁻² on the horizontal.
fn standing(zenith_deg: f64, azimuth_deg: f64, expected_W: f64) -> Verdict {
    let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
    let at = |y: f64, z: f64| DVec3::new(0.2, y, z);
    scenery.quad(
        "leaf 1",
        [at(0.1, 0.0), at(0.3, 0.0), at(0.3, 0.3), at(0.1, 0.3)],
    );
    scenery.band("B", 0.0, &[("leaf", LeafOptics::default())]);
    scenery.source(from_zenith(zenith_deg, azimuth_deg), 100.0);
    let item = solved(&scenery.scene(), &coarse())?.solution.organs[0];
    within_se("power/W", item.absorbed_W, expected_W, item.absorbed_se_W)
}

/// Three plates under one source.
fn under(direction: DVec3, irradiance_W_m2: f64) -> Verdict {
    let leaf = LeafOptics::symmetric(0.4, 0.4);
    let mut scenery = plates(3, 0.1, leaf, 0.2);
    scenery.sources.clear();
    scenery.source(direction, irradiance_W_m2);
    let solution = changed(&scenery.scene(), &coarse(), |plan| {
        (plan.trace.max_edge_m, plan.light.tolerance.absorbed) = (0.1, 1e-7);
    })?
    .solution;
    let incoming = irradiance_W_m2 * 0.24;
    all([
        near(
            "albedo",
            shares(&solution, 0).up,
            stack(3, leaf, 0.2).albedo,
            1e-3,
        ),
        near(
            "incoming",
            solution.balance[0].incoming_W / incoming,
            1.0,
            1e-9,
        ),
    ])
}

fn file(text: &str) -> Result<Vec<LightSource>, String> {
    parse("sun.light", text.as_bytes()).map_err(refusal)
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = vec![
        Case::new(
            AXIS,
            "sun in the zenith, a standing sheet",
            "gets nothing",
            || standing(0.0, 0.0, 0.0),
        ),
        Case::new(
            AXIS,
            "sun at 45° along x: lines that close on themselves",
            "I tan 45° times the area",
            || standing(45.0, 0.0, 6.0),
        ),
        Case::new(
            AXIS,
            "sun at 45° along y, along the sheet",
            "gets nothing",
            || standing(45.0, 90.0, 0.0),
        ),
        Case::new(
            AXIS,
            "sun at 89.9° along x",
            "all that comes down over the sheet's width, as its copies stand close: 12 W",
            || standing(89.9, 0.0, 12.0),
        ),
        Case::new(AXIS, "sun at 89.99° along x", "the same", || {
            standing(89.99, 0.0, 12.0)
        }),
        Case::new(
            AXIS,
            "sun at 89.9°, a leaf alone that faces it",
            "I tan 89.9° times the area",
            || {
                let mut scenery = Scenery::open();
                scenery.triangle("leaf 1", [DVec3::ZERO, DVec3::Z * 0.3, DVec3::Y * 0.2]);
                scenery.band("B", 0.0, &[("leaf", LeafOptics::default())]);
                scenery.source(from_zenith(89.9, 0.0), 100.0);
                let item = solved(&scenery.scene(), &coarse())?.solution.organs[0];
                let expected = 100.0 * 89.9f64.to_radians().tan() * 0.03;
                within_se("power/W", item.absorbed_W, expected, item.absorbed_se_W)
            },
        ),
        Case::new(
            AXIS,
            "sun on the horizon",
            "refused: at a given irradiance of the horizontal its beam is without bounds",
            || {
                refused(
                    file("100 1 0 -1e-5\n"),
                    &["sun.light, line 1", "points down"],
                )
            },
        ),
        Case::new(
            AXIS,
            "irradiance 1e300 W m⁻²",
            "refused: its square is no number",
            || refused(file("1e300 0 0 -1\n"), &["sun.light, line 1", "irradiance"]),
        ),
        Case::new(
            AXIS,
            "irradiance 1e-300 W m⁻²",
            "refused: its square is nothing",
            || {
                refused(
                    file("1e-300 0 0 -1\n"),
                    &["sun.light, line 1", "irradiance"],
                )
            },
        ),
        Case::new(AXIS, "no light at all", "all results 0", || {
            let mut scenery = plates(2, 0.1, LeafOptics::symmetric(0.4, 0.4), 0.2);
            scenery.sources.clear();
            let solution = solved(&scenery.scene(), &coarse())?.solution;
            near("power/W", solution.organs[0].absorbed_W, 0.0, 0.0)
        }),
        Case::new(AXIS, "10,000 sources", "adding of 3 plates", || {
            let leaf = LeafOptics::symmetric(0.4, 0.4);
            let mut scenery = plates(3, 0.1, leaf, 0.2);
            scenery.sources = uniform_sky(10_000, 1);
            let solution = changed(&scenery.scene(), &coarse(), |plan| {
                (plan.trace.max_edge_m, plan.light.direct_line_area_m2) = (0.1, 1e-3);
            })?
            .solution;
            near(
                "albedo",
                shares(&solution, 0).up,
                stack(3, leaf, 0.2).albedo,
                1e-3,
            )
        }),
        Case::new(
            AXIS,
            "a sun 1e12 times as strong as another",
            "adding of 3 plates for both together",
            || {
                let leaf = LeafOptics::symmetric(0.4, 0.4);
                let mut scenery = plates(3, 0.1, leaf, 0.2);
                scenery.source(from_zenith(20.0, 0.0), 1e14);
                let solution = changed(&scenery.scene(), &coarse(), |p| p.trace.max_edge_m = 0.1)?;
                let albedo = stack(3, leaf, 0.2).albedo;
                near("albedo", shares(&solution.solution, 0).up, albedo, 1e-3)
            },
        ),
        Case::new(
            AXIS,
            "two suns of one direction in one file",
            "taken as one",
            || {
                let folder = tempfile::tempdir().map_err(|e| e.to_string())?;
                let path = folder.path().join("sun.light");
                fs::write(&path, "1 0 0 -1\n2 0 0 -2\n").map_err(|e| e.to_string())?;
                let text = fs::read_to_string(&path).map_err(|e| e.to_string())?;
                let file = nestrad_common::assemble::LightFile {
                    sources: self::file(&text)?,
                    band: None,
                };
                let merged = nestrad_common::assemble::merge_sources(&[file], 1);
                near("sources", merged.len() as f64, 1.0, 0.0)
            },
        ),
    ];
    for irradiance in [1e-12, 1e12] {
        cases.push(Case::new(
            AXIS,
            format!("irradiance {irradiance:e} W m⁻²"),
            "adding of 3 plates; the incoming power to rounding",
            move || under(-DVec3::Z, irradiance),
        ));
    }
    for (name, zenith, azimuth) in [
        ("sun at 89.9°, plates", 89.9, 17.0),
        ("sun at 89.99° along x, plates", 89.99, 0.0),
        ("sun at 60° along y, plates", 60.0, 90.0),
    ] {
        cases.push(Case::new(
            AXIS,
            name,
            "adding of 3 plates, whatever the direction",
            move || under(from_zenith(zenith, azimuth), 100.0),
        ));
    }
    cases
}
