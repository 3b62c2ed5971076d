//! Optics at their ends: full plates over soil, where the adding of layers is exact and every row sees
//! one plate and nothing else.

use nestrad_common::optics::{FaceOptics, LeafOptics};
use nestrad_engine::plan::Plan;

use super::judge::{all, changed, coarse, near, refused};
use super::{Case, Verdict};
use crate::adding::{plates, stack};
use crate::solving::shares;

const AXIS: &str = "Optics";

/// Elements that are large against the lines are evenly lit: then nothing is left to chance.
fn evenly(plan: &mut Plan) {
    (plan.trace.max_edge_m, plan.light.direct_line_area_m2) = (0.1, 5e-6);
    plan.light.tolerance.absorbed = 1e-8;
}

/// How far from the recursion a plate may be.
const BOUND: f64 = 1e-6;

fn follows_recursion(n: usize, leaf: LeafOptics, soil_albedo: f64) -> Verdict {
    let scenery = plates(n, 0.1, leaf, soil_albedo);
    let expected = stack(n, leaf, soil_albedo);
    let solution = changed(&scenery.scene(), &coarse(), evenly)?.solution;
    let found = shares(&solution, 0);
    let soil = (1.0 - soil_albedo) * expected.soil;
    let plates = 1.0 - expected.albedo - soil;
    all([
        near("albedo", found.up, expected.albedo, BOUND),
        near("soil", found.soil, soil, BOUND),
        near("plates", found.plants, plates, BOUND),
    ])
}

fn case(name: &str, n: usize, leaf: LeafOptics, soil: f64) -> Case {
    let expected = format!(
        "adding of {n} plates: albedo {:.7}",
        stack(n, leaf, soil).albedo
    );
    Case::new(AXIS, name, expected, move || {
        follows_recursion(n, leaf, soil)
    })
}

const fn face(rho: f64, tau: f64) -> FaceOptics {
    FaceOptics { rho, tau }
}

pub(super) fn cases() -> Vec<Case> {
    let same = LeafOptics::symmetric;
    let faces = |upper, lower| LeafOptics { upper, lower };
    let mut cases = vec![
        case("black leaves, black soil", 3, same(0.0, 0.0), 0.0),
        case("black leaves, white soil", 3, same(0.0, 0.0), 1.0),
        case("rho = tau = 0.3", 3, same(0.3, 0.3), 0.2),
        case("rho = 0, tau = 0.6", 3, same(0.0, 0.6), 0.2),
        case("rho = 0.6, tau = 0", 3, same(0.6, 0.0), 0.2),
        case("rho = 1, tau = 0", 3, same(1.0, 0.0), 0.5),
        case("rho = 0, tau = 1", 3, same(0.0, 1.0), 0.5),
        case("rho + tau = 0.9", 4, same(0.5, 0.4), 0.2),
        case("rho + tau = 0.99", 4, same(0.5, 0.49), 0.2),
        case("rho + tau = 0.999", 4, same(0.5, 0.499), 0.2),
        case("rho + tau = 0.999999", 4, same(0.5, 0.499_999), 0.2),
        case("rho + tau = 1, black soil", 4, same(0.5, 0.5), 0.0),
        case("rho + tau = 1e-12", 3, same(5e-13, 5e-13), 0.2),
        case(
            "upper face white, lower face black",
            3,
            faces(face(1.0, 0.0), face(0.0, 0.0)),
            0.5,
        ),
        case(
            "upper face black, lower face white",
            3,
            faces(face(0.0, 0.0), face(1.0, 0.0)),
            0.5,
        ),
        case(
            "upper face clear, lower face black",
            3,
            faces(face(0.0, 1.0), face(0.0, 0.0)),
            0.5,
        ),
        case(
            "faces wildly different",
            3,
            faces(face(0.9, 0.1), face(0.01, 0.2)),
            0.3,
        ),
        case(
            "the same, swapped",
            3,
            faces(face(0.01, 0.2), face(0.9, 0.1)),
            0.3,
        ),
        case(
            "white soil under translucent leaves",
            3,
            same(0.2, 0.7),
            1.0,
        ),
    ];
    cases.push(Case::new(
        AXIS,
        "rho + tau = 1, white soil",
        "conservation: albedo 1 within 1e-6 and the closure's error",
        move || {
            let scenery = plates(4, 0.1, same(0.3, 0.7), 1.0);
            let solution = changed(&scenery.scene(), &coarse(), evenly)?.solution;
            near("albedo", shares(&solution, 0).up, 1.0, BOUND)
        },
    ));
    cases.push(Case::new(
        AXIS,
        "light valve: clear from above, white from below, over white soil",
        "no steady state: a refusal that says that nothing converges",
        move || {
            let valve = faces(face(0.0, 1.0), face(1.0, 0.0));
            let scenery = plates(1, 0.1, valve, 1.0);
            let outcome = changed(&scenery.scene(), &coarse(), evenly);
            refused(outcome, &["did not converge", "band B"])
        },
    ));
    for (name, n, scattered, soil) in [
        (
            "20 plates, rho + tau = 0.999999, black soil",
            20,
            0.999_999,
            0.0,
        ),
        ("50 plates, rho + tau = 1, black soil", 50, 1.0, 0.0),
        ("50 plates, rho + tau = 1, white soil", 50, 1.0, 1.0),
    ] {
        let leaf = same(0.5 * scattered, 0.5 * scattered);
        let albedo = stack(n, leaf, soil).albedo;
        cases.push(Case::new(
            AXIS,
            name,
            format!(
                "adding of {n} plates: albedo {albedo:.7}, in at most {} passes",
                most_passes(n)
            ),
            move || deep(n, leaf, soil),
        ));
    }
    cases.push(Case::new(
        AXIS,
        "64 bands from black to white in one solve",
        "adding of 3 plates in every band",
        sixty_four_bands,
    ));
    cases
}

/// Passes over all rows that a solve may take, however little is absorbed: of so many plates.
fn most_passes(plates: usize) -> u32 {
    if plates <= 20 { 60 } else { 150 }
}

fn deep(n: usize, leaf: LeafOptics, soil_albedo: f64) -> Verdict {
    let scenery = plates(n, 0.1, leaf, soil_albedo);
    let solved = changed(&scenery.scene(), &coarse(), |plan| {
        evenly(plan);
        plan.light.tolerance.absorbed = 1e-6;
    })?;
    let passes = solved.work.passes;
    if passes > most_passes(n) {
        return Err(format!("{passes} passes"));
    }
    let albedo = shares(&solved.solution, 0).up;
    let what = format!("{passes} passes, albedo");
    near(&what, albedo, stack(n, leaf, soil_albedo).albedo, BOUND)
}

fn sixty_four_bands() -> Verdict {
    let leaf = |b: u32| LeafOptics::symmetric(f64::from(b) / 126.0, f64::from(b) / 130.0);
    let mut scenery = plates(3, 0.1, leaf(0), 0.2);
    scenery.bands.clear();
    for b in 0..64 {
        scenery.band(&format!("B{b}"), 0.2, &[("leaf", leaf(b))]);
    }
    for source in &mut scenery.sources {
        source.irradiance_W_m2 = vec![source.irradiance_W_m2[0]; 64];
    }
    let solution = changed(&scenery.scene(), &coarse(), evenly)?.solution;
    all((0..64).rev().map(|b| {
        let expected = stack(3, leaf(b), 0.2).albedo;
        near(
            &format!("albedo of band {b}"),
            shares(&solution, b as usize).up,
            expected,
            BOUND,
        )
    }))
}
