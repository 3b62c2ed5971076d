//! Geometry at its ends: sizes, shapes, and places that surfaces share.

use glam::{DVec2, DVec3};
use nestrad_common::optics::LeafOptics;
use nestrad_common::problem::Problem;
use nestrad_master::plan::{Estimator, Settings};
use nestrad_master::solution::ItemLight;

use super::judge::{all, changed, coarse, near, refused, solved, solving, within_se};
use super::{Case, Verdict};
use crate::adding::{plates, stack};
use crate::enclosure::closed_box;
use crate::scenery::{Scenery, from_zenith};
use crate::solving::{ESTIMATORS, shares};

const AXIS: &str = "Geometry";

/// Irradiance of the horizontal, W m⁻².
const SUN: f64 = 100.0;

fn by(estimator: Estimator) -> Settings {
    Settings {
        estimator,
        ..coarse()
    }
}

/// A right triangle that looks up, with legs along x and y.
fn flat(at: DVec3, legs: DVec2) -> [DVec3; 3] {
    [at, at + DVec3::X * legs.x, at + DVec3::Y * legs.y]
}

/// Ends a scene: one band and a sun in the zenith.
fn lit(mut scenery: Scenery, leaf: LeafOptics, soil_albedo: f64) -> Problem {
    scenery.band("B", soil_albedo, &[("leaf", leaf)]);
    scenery.source(-DVec3::Z, SUN);
    scenery.problem
}

pub(super) fn cases() -> Vec<Case> {
    let mut cases = sizes();
    cases.extend(shared_places());
    cases.extend(edges_of_the_world());
    cases.extend(counts());
    cases
}

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
    let problem = lit(scenery, LeafOptics::symmetric(rho, 0.0), 0.0);
    let item = solved(&problem, &by(estimator))?.solution.organs[0];
    near("lower/upper", item.irradiance_lower_W_m2 / SUN, rho, 0.05)
}

fn sizes() -> Vec<Case> {
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
                let problem = lit(scenery, LeafOptics::symmetric(0.4, 0.4), 0.2);
                let finished = solved(&problem, &coarse())?;
                let elements = finished.counters.elements;
                if elements > 200_000 {
                    return Err(format!("{elements} elements"));
                }
                near("albedo", shares(&finished.solution, 0).up, 0.2, 1e-3)
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
                let problem = lit(scenery, LeafOptics::symmetric(0.4, 0.4), 0.2);
                let solution = changed(&problem, &coarse(), |p| p.max_edge_m = 0.1)?.solution;
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

/// `n` leaves in one place, on alternate sides up: the light of all is that of as many plates.
fn in_one_place(n: usize, leaf: LeafOptics, turn: bool, estimator: Estimator) -> Verdict {
    let mut scenery = Scenery::periodic(DVec2::new(0.6, 0.4)).soil(0.0);
    for k in 0..n {
        let at = |x: f64, y: f64| DVec3::new(0.6 * x, 0.4 * y, 0.3);
        let mut corners = [at(0., 0.), at(1., 0.), at(1., 1.), at(0., 1.)];
        if turn && k % 2 == 1 {
            // the same two triangles, turned over
            corners = [corners[0], corners[3], corners[2], corners[1]];
        }
        scenery.quad(&format!("leaf {k}"), corners);
    }
    let problem = lit(scenery, leaf, 0.2);
    let solution = changed(&problem, &by(estimator), |plan| {
        (plan.max_edge_m, plan.tolerance.absorbed) = (0.3, 1e-6);
    })?
    .solution;
    let expected = stack(n, leaf, 0.2);
    let found = shares(&solution, 0);
    all([
        near("albedo", found.up, expected.albedo, 1e-4),
        near("soil", found.soil, 0.8 * expected.soil, 1e-4),
    ])
}

fn shared_places() -> Vec<Case> {
    let mut cases = Vec::new();
    for estimator in ESTIMATORS {
        for (name, n, turn) in [
            ("2 times the same leaf", 2, false),
            ("100 times the same leaf", 100, false),
            ("2 leaves back to back", 2, true),
        ] {
            cases.push(Case::new(
                AXIS,
                format!("{name}, {estimator:?}"),
                format!("adding of {n} plates"),
                move || in_one_place(n, LeafOptics::symmetric(0.4, 0.4), turn, estimator),
            ));
        }
        cases.push(Case::new(
            AXIS,
            format!("leaves 0.1 mm apart, 10 m above the soil, {estimator:?}"),
            "adding of 3 plates",
            move || {
                let leaf = LeafOptics::symmetric(0.45, 0.45);
                let mut problem = plates(3, 1e-4, leaf, 0.2).problem;
                problem.scene.soil_z_m = Some(-10.0);
                let solution = changed(&problem, &by(estimator), |plan| {
                    (plan.max_edge_m, plan.direct_line_area_m2) = (0.1, 5e-6);
                })?
                .solution;
                near(
                    "albedo",
                    shares(&solution, 0).up,
                    stack(3, leaf, 0.2).albedo,
                    1e-3,
                )
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("T-junctions: a flat leaf of three triangles that share no edge whole, {estimator:?}"),
            "no face of a flat leaf sees another: the lower ones stay dark",
            move || flat_leaf_with_t_junctions(estimator),
        ));
        cases.push(Case::new(
            AXIS,
            format!("a closed box in the sun, white inside, {estimator:?}"),
            "dark inside",
            move || {
                let mut scenery = Scenery::open();
                closed_box(&mut scenery, DVec3::splat(0.1), DVec3::new(0.3, 0.4, 0.5));
                let white = LeafOptics::opaque(1.0);
                scenery.band("B", 0.0, &[("wall", white)]);
                scenery.source(from_zenith(40.0, 30.0), SUN);
                let solution = solved(&scenery.problem, &by(estimator))?.solution;
                let inside: Vec<f64> = solution
                    .organs
                    .iter()
                    .map(|o| o.irradiance_upper_W_m2)
                    .collect();
                near(
                    "irradiance",
                    inside.into_iter().fold(0.0, f64::max),
                    0.0,
                    0.0,
                )
            },
        ));
        cases.push(Case::new(
            AXIS,
            format!("two leaves through each other, {estimator:?}"),
            "one is the other mirrored: both take the same",
            move || crossing(estimator),
        ));
    }
    cases
}

fn flat_leaf_with_t_junctions(estimator: Estimator) -> Verdict {
    // in a slanted plane
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.3 * x - 0.2 * y);
    let mut scenery = Scenery::open();
    scenery.triangle("leaf 1", [at(0., 0.), at(1., 0.), at(0., 1.)]);
    scenery.triangle("leaf 1", [at(1., 0.), at(1., 1.), at(0.5, 0.5)]);
    scenery.triangle("leaf 1", [at(1., 1.), at(0., 1.), at(0.5, 0.5)]);
    let problem = lit(scenery, LeafOptics::opaque(0.9), 0.0);
    let item = solved(&problem, &by(estimator))?.solution.organs[0];
    all([
        near("lower", item.irradiance_lower_W_m2, 0.0, 0.0),
        within_se("power/W", item.absorbed_W, 0.1 * SUN, item.absorbed_se_W),
    ])
}

/// Two squares that cross in a line along y, mirrored in the plane x = 0, in the sun of the zenith.
fn crossing(estimator: Estimator) -> Verdict {
    let mut scenery = Scenery::open();
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let one = [
        at(-1., 0., -1.),
        at(1., 0., 1.),
        at(1., 2., 1.),
        at(-1., 2., -1.),
    ];
    scenery.quad("leaf 1", one);
    let mirrored = one.map(|v| DVec3::new(-v.x, v.y, v.z));
    scenery.quad(
        "leaf 2",
        [mirrored[1], mirrored[0], mirrored[3], mirrored[2]],
    );
    let problem = lit(scenery, LeafOptics::symmetric(0.4, 0.4), 0.0);
    let organs = solved(&problem, &by(estimator))?.solution.organs;
    let [a, b] = [organs[0], organs[1]];
    let se = a.absorbed_se_W.hypot(b.absorbed_se_W);
    within_se("power/W", a.absorbed_W, b.absorbed_W, se)
}

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
    let finished = changed(&scenery.problem, &by(estimator), |p| p.max_edge_m = 0.05)?;
    Ok(finished.solution.organs[0])
}

fn same_power(a: ItemLight, b: ItemLight) -> Verdict {
    let se = a.absorbed_se_W.hypot(b.absorbed_se_W);
    within_se("power/W", a.absorbed_W, b.absorbed_W, se)
}

fn edges_of_the_world() -> Vec<Case> {
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
                let mut problem = plates(1, 0.1, leaf, 0.6).problem;
                problem.scene.soil_z_m = Some(0.1);
                let solution = changed(&problem, &by(estimator), |plan| {
                    (plan.max_edge_m, plan.direct_line_area_m2) = (0.1, 5e-6);
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
                let problem = lit(scenery, LeafOptics::symmetric(0.5, 0.5), 1.0);
                let solution = changed(&problem, &by(estimator), |p| p.max_edge_m = 0.2)?.solution;
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
                let problem = lit(scenery, LeafOptics::default(), 0.5);
                refused(solved(&problem, &coarse()), &["pattern"])
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
                solved(&scenery.problem, &coarse()).map(|f| f.solution.organs[0])
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

fn counts() -> Vec<Case> {
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
            let problem = lit(Scenery::open(), LeafOptics::default(), 0.0);
            solved(&problem, &coarse())
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
                let problem = lit(scenery, leaf, 0.2);
                let solution = changed(&problem, &coarse(), |p| p.max_edge_m = 0.1)?.solution;
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
                let problem = lit(scenery, LeafOptics::symmetric(0.5, 0.5), 1.0);
                let solution = solved(&problem, &coarse())?.solution;
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
                let problem = lit(scenery, LeafOptics::opaque(0.5), 0.2);
                refused(solved(&problem, &coarse()), &["GiB", "--memory"])
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
    let problem = lit(scenery, leaf, 0.0);
    let solution = solved(&problem, &coarse())?.solution;
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
