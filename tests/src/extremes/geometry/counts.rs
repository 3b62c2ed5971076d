//! How many there are: none, one, a hundred thousand in one place.

use glam::{DVec2, DVec3};
use nestrad_common::optics::LeafOptics;

use super::{AXIS, SUN, flat, lit};
use crate::adding::stack;
use crate::extremes::judge::{changed, coarse, near, refused, solved, solving, within_se};
use crate::extremes::{Case, Verdict};
use crate::scenery::Scenery;
use crate::solving::shares;

pub(super) fn cases() -> Vec<Case> {
    vec![
        Case::new(
            AXIS,
            "no triangle",
            "soil alone: gets the sun, sends back its albedo",
            || {
                let scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
                let solution =
                    solved(&lit(scenery, LeafOptics::default(), 0.3), &coarse())?.solution;
                near("albedo", shares(&solution, 0).up, 0.3, 1e-12)
            },
        ),
        Case::new(AXIS, "nothing at all", "solved: no light is taken", || {
            let scene = lit(Scenery::open(), LeafOptics::default(), 0.0);
            solved(&scene, &coarse())
                .map(|f| solving(format!("{} organs", f.solution.organs.len())))
        }),
        Case::new(
            AXIS,
            "1e5 triangles in one point, above a plate",
            "they have no area and change nothing: adding of 1 plate",
            || {
                let leaf = LeafOptics::symmetric(0.4, 0.4);
                let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
                scenery.level("leaf 1", DVec3::Z * 0.2, DVec2::new(0.6, 0.4));
                for _ in 0..100_000 {
                    scenery.triangle("leaf 2", [DVec3::new(0.3, 0.2, 0.3); 3]);
                }
                let scene = lit(scenery, leaf, 0.2);
                let solution = changed(&scene, &coarse(), |p| p.trace.max_edge_m = 0.1)?.solution;
                near(
                    "albedo",
                    shares(&solution, 0).up,
                    stack(1, leaf, 0.2).albedo,
                    1e-3,
                )
            },
        ),
        Case::new(
            AXIS,
            "1e5 leaves within a micrometre",
            "white: albedo 1",
            || {
                let mut scenery = Scenery::periodic(DVec2::new(0.01, 0.01)).soil(0.0);
                for k in 0..100_000u32 {
                    let k = f64::from(k);
                    let at = |step: f64| (k * step).fract() * 1e-6;
                    let foot =
                        DVec3::new(0.005 + at(0.7548), 0.005 + at(0.5698), 0.004 + at(0.618));
                    scenery.triangle("leaf 1", flat(foot, DVec2::splat(1e-7)));
                }
                let scene = lit(scenery, LeafOptics::symmetric(0.5, 0.5), 1.0);
                let solution = solved(&scene, &coarse())?.solution;
                near("albedo", shares(&solution, 0).up, 1.0, 2e-3)
            },
        ),
        Case::new(
            AXIS,
            "1e5 times the same black leaf",
            "together they take what one would",
            || many_times(100_000, LeafOptics::default()),
        ),
        Case::new(
            AXIS,
            "1e5 times the same white leaf of half a square millimetre",
            "they take nothing",
            || many_times(100_000, LeafOptics::opaque(1.0)),
        ),
        Case::new(
            AXIS,
            "1e5 times a plate that fills the pattern",
            "refused: more is seen along a line than fits the memory",
            || {
                let mut scenery = Scenery::periodic(DVec2::ONE).soil(0.0);
                for _ in 0..50_000 {
                    scenery.level("leaf 1", DVec3::Z * 0.2, DVec2::ONE);
                }
                let scene = lit(scenery, LeafOptics::opaque(0.5), 0.2);
                refused(solved(&scene, &coarse()), &["GiB", "--memory"])
            },
        ),
    ]
}

/// One leaf many times over, alone on a pattern of 10 cm.
fn many_times(n: usize, leaf: LeafOptics) -> Verdict {
    let mut scenery = Scenery::periodic(DVec2::splat(0.1)).soil(0.0);
    for _ in 0..n {
        scenery.triangle("leaf 1", flat(DVec3::splat(0.005), DVec2::splat(1e-3)));
    }
    let scene = lit(scenery, leaf, 0.0);
    let solution = solved(&scene, &coarse())?.solution;
    let balance = &solution.balance[0];
    let absorbed = balance.absorbed_plants_W.value;
    let se = solution
        .organs
        .iter()
        .map(|o| o.absorbed_se_W.powi(2))
        .sum::<f64>()
        .sqrt();
    let expected = SUN * 5e-7 * leaf.upper.absorptance();
    within_se("power/W", absorbed, expected, se)
}
