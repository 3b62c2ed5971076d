//! Faults of the existing implementation (DESIGN, section 8), each shown not to be here. What its
//! parsers do is tested with the parsers.

#![allow(clippy::unwrap_used)]

use glam::{DVec2, DVec3};
use nestrad_common::optics::LeafOptics;
use nestrad_common::options::Unit;
use nestrad_engine::plan::{Estimator, Settings};
use nestrad_engine::solution::Solution;
use nestrad_kernel::ends::Side::{Lower, Upper};
use nestrad_tests::canopies::{par_and_nir, scenery, small_maize};
use nestrad_tests::enclosure::full_plate;
use nestrad_tests::files::Written;
use nestrad_tests::form_factor::Traced;
use nestrad_tests::scenery::{Scenery, from_zenith};
use nestrad_tests::solving::{ESTIMATORS, by, sampling, shares, solve};
use nestrad_tests::statistics::{assert_close, assert_within};

const OPTICS: [&str; 2] = [
    "n 1\ns d 0.15\ne d 0.12 d 0.09 0.05 d 0.11 0.05\n",
    "n 1\ns d 0.25\ne d 0.50 d 0.44 0.45 d 0.46 0.44\n",
];

/// Leaves of a few centimetres that shade each other, at coordinates that are no whole numbers in any
/// unit.
fn leaves() -> Vec<[DVec3; 3]> {
    (0..60)
        .map(|k| {
            let k = f64::from(k);
            // the additive recurrence of the golden ratio and its like spread points evenly
            let at = |step: f64| (k * step).fract();
            let foot = DVec3::new(
                0.4 * at(0.754_877),
                0.3 * at(0.569_840),
                0.25 * at(0.618_034),
            );
            let turn = std::f64::consts::TAU * at(0.414_214);
            let along = DVec3::new(turn.cos(), turn.sin(), at(0.732_051) - 0.5);
            let across = DVec3::new(-turn.sin(), turn.cos(), 0.3);
            [foot, foot + 0.08 * along, foot + 0.06 * across]
        })
        .collect()
}

fn written(unit: Unit, moved_m: DVec3) -> Solution {
    let folder = tempfile::tempdir().unwrap();
    let leaves = leaves();
    let written = Written {
        leaves: &leaves,
        pattern_m: Some([0.0, 0.0, 0.4, 0.3]),
        soil_m: Some(-0.05),
        optics: &OPTICS,
        light: "80 0.3 0.1 -0.8\n20 -0.5 0.2 -0.4\n",
        unit,
        moved_m,
    };
    solve(&written.load(folder.path()), &Settings::default()).solution
}

/// Absorbed power of every organ in every band.
fn absorbed(solution: &Solution) -> Vec<f64> {
    solution.organs.iter().map(|item| item.absorbed_W).collect()
}

/// Fails unless all organs absorb the same to `bound` of what the largest of them absorbs.
#[track_caller]
fn assert_same(a: &Solution, b: &Solution, bound: f64) {
    let (a, b) = (absorbed(a), absorbed(b));
    let largest = a.iter().copied().fold(0.0, f64::max);
    assert!(largest > 0.0);
    let worst = a.iter().zip(&b).map(|(a, b)| (a - b).abs() / largest);
    let worst = worst.fold(0.0, f64::max);
    assert!(
        worst <= bound,
        "an organ differs by {worst:.1e} of the largest"
    );
}

/// Rounding of vertices alone may put a lattice point on the other side of an edge.
const ROUNDING: f64 = 1e-3;

#[test]
fn results_do_not_depend_on_the_unit_of_length() {
    let metres = written(Unit::Metre, DVec3::ZERO);
    for unit in [Unit::Centimetre, Unit::Millimetre] {
        assert_same(&metres, &written(unit, DVec3::ZERO), ROUNDING);
    }
}

#[test]
fn light_does_not_vanish_far_from_the_origin() {
    let here = written(Unit::Metre, DVec3::ZERO);
    let there = written(Unit::Metre, DVec3::new(9e5, -9e5, 300.0));
    assert_same(&here, &there, ROUNDING);
}

/// A second band must not be scaled by anything of the first one: each band alone gives what both
/// together give, whichever comes first.
#[test]
fn a_second_band_is_solved_like_a_first_one() {
    let sky = |bands: usize| {
        let mut scenery = scenery(&small_maize(), &par_and_nir()[..bands], Vec::new());
        scenery.source(from_zenith(35.0, 20.0), 300.0);
        scenery.source(from_zenith(10.0, 200.0), 100.0);
        scenery
    };
    let both = sky(2);
    // as an unequal pair: the first band gets 7 times the light of the second one
    let lit = |mut scenery: Scenery| {
        for source in &mut scenery.sources {
            if let [first, _] = &mut source.irradiance_W_m2[..] {
                *first *= 7.0;
            }
        }
        scenery
    };
    let settings = Settings {
        diameter: nestrad_common::options::Diameter::Metres(0.5),
        ..Settings::default()
    };
    let both = lit(both);
    let together = solve(&both.scene(), &settings).solution;
    for band in 0..2 {
        let mut alone = both.clone();
        alone.bands = vec![both.bands[band].clone()];
        for source in &mut alone.sources {
            source.irradiance_W_m2 = vec![source.irradiance_W_m2[band]];
        }
        let alone = solve(&alone.scene(), &settings).solution;
        let largest = absorbed(&alone).into_iter().fold(0.0, f64::max);
        for (o, item) in alone.organs.iter().enumerate() {
            let with = together.organs[2 * o + band].absorbed_W;
            let what = format!("band {band} of organ {o}");
            // direct light is sampled by the strength of the sources: the same for both
            assert_within(&what, with, item.absorbed_W, 1e-3 * largest);
        }
    }
}

#[test]
fn triangles_of_one_flat_leaf_do_not_see_each_other() {
    let mut scenery = Scenery::open();
    // tilted, so that its corners are not exactly in a plane
    let across = DVec3::new(0.3, 0.7, 0.2);
    let along = DVec3::new(0.8, -0.1, 0.4);
    let corner = DVec3::new(0.1, 0.2, 0.3);
    scenery.quad(
        "leaf",
        [
            corner,
            corner + along,
            corner + along + across,
            corner + across,
        ],
    );
    for estimator in ESTIMATORS {
        let traced = Traced::new(&scenery.canopy(), 0.2, &sampling(estimator, 0.01, 1000.0));
        for from in [Upper, Lower] {
            for to in [Upper, Lower] {
                let f = traced.form_factor((0, from), (0, to));
                assert_eq!(f.value, 0.0, "{estimator:?} {from:?} to {to:?}");
            }
        }
    }
}

/// The plates are a tenth of their width apart: at the centre of a plate nothing but the other one is
/// in sight, near its edge a good part of the sky is. F at the centroid of the plate is 0.98 (Howell
/// C-11 of 4 corner pieces), F of the plate 0.8270; a coarse and a fine cut must both give that.
#[test]
fn form_factors_are_not_those_of_the_centroid() {
    let mut scenery = Scenery::open();
    scenery.level("plate 1", DVec3::ZERO, DVec2::ONE);
    scenery.level("plate 2", DVec3::Z * 0.1, DVec2::ONE);
    let expected = equal_squares(10.0);
    assert_within("Howell C-11", equal_squares(1.0), 0.199_824_9, 1e-7);
    for estimator in ESTIMATORS {
        for edge in [f64::INFINITY, 0.2] {
            let rays = 4e5 / scenery.elements(edge) as f64;
            let mut sampling = sampling(estimator, 0.02, rays);
            sampling.sets_per_batch *= 4;
            let traced = Traced::new(&scenery.canopy(), edge, &sampling);
            let f = traced.form_factor((0, Upper), (1, Lower));
            let what = format!("{estimator:?}, edges of {edge}");
            assert_close(&what, f.value, expected, f.se, 4.0, 2e-3);
        }
    }
}

/// Parallel unit squares at distance 1 / x (Howell's catalogue of configuration factors, C-11).
fn equal_squares(x: f64) -> f64 {
    let s = (1.0 + x * x).sqrt();
    2.0 / (std::f64::consts::PI * x * x)
        * ((s * s / (1.0 + 2.0 * x * x).sqrt()).ln() + 2.0 * x * s * (x / s).atan()
            - 2.0 * x * x.atan())
}

/// A vertical square that stands half above and half below a horizontal one sees it from above with
/// its upper half and from below with its lower one. Each half is a rectangle 1 x 1/2 with a common
/// edge: Howell C-14 gives what the horizontal face sees of it.
#[test]
fn an_emitter_that_crosses_the_receivers_plane_is_seen_from_both_sides() {
    let mut scenery = Scenery::open();
    scenery.level("receiver", DVec3::ZERO, DVec2::ONE);
    let at = |y: f64, z: f64| DVec3::new(0.0, y, z);
    // its lower face looks at the receiver
    scenery.quad(
        "emitter",
        [at(0.0, -0.5), at(0.0, 0.5), at(1.0, 0.5), at(1.0, -0.5)],
    );
    // C-14 with height 1/2 and width 1 of the receiver, over the common edge of length 1
    let expected = perpendicular(0.5, 1.0);
    assert_within("Howell C-14", perpendicular(1.0, 1.0), 0.200_043_8, 1e-7);
    for estimator in ESTIMATORS {
        for edge in [f64::INFINITY, 0.3] {
            let rays = 4e5 / scenery.elements(edge) as f64;
            let mut sampling = sampling(estimator, 0.02, rays);
            sampling.sets_per_batch *= 4;
            let traced = Traced::new(&scenery.canopy(), edge, &sampling);
            for side in [Upper, Lower] {
                let f = traced.form_factor((0, side), (1, Lower));
                let what = format!("{estimator:?} {side:?}, edges of {edge}");
                assert_close(&what, f.value, expected, f.se, 4.0, 2e-3);
                assert_eq!(
                    traced.form_factor((0, side), (1, Upper)).value,
                    0.0,
                    "{what}"
                );
            }
        }
    }
}

/// From a rectangle of width `w` to a perpendicular one of height `h`, common edge of length 1
/// (Howell's catalogue, C-14).
fn perpendicular(h: f64, w: f64) -> f64 {
    let (h2, w2) = (h * h, w * w);
    let s = h2 + w2;
    let logs = ((1.0 + w2) * (1.0 + h2) / (1.0 + s)).ln()
        + w2 * (w2 * (1.0 + s) / ((1.0 + w2) * s)).ln()
        + h2 * (h2 * (1.0 + s) / ((1.0 + h2) * s)).ln();
    (w * (1.0 / w).atan() + h * (1.0 / h).atan() - s.sqrt() * (1.0 / s.sqrt()).atan() + 0.25 * logs)
        / (std::f64::consts::PI * w)
}

/// What leans over the edge of the pattern is lit there, and shades what is there, under vertical
/// light as under any other: moving everything by part of a pattern changes nothing.
#[test]
fn what_hangs_over_the_edge_of_the_pattern_keeps_its_light() {
    for zenith in [0.0, 50.0] {
        for offset in [DVec2::ZERO, DVec2::new(0.27, 0.11), DVec2::new(-3.4, 0.05)] {
            let mut scenery = Scenery::periodic(DVec2::new(0.5, 0.4)).soil(0.0);
            full_plate(&mut scenery, "leaf full", 0.2, offset);
            scenery.level("leaf small", offset.extend(0.3), DVec2::new(0.4, 0.3));
            scenery.band("B", 0.0, &[]);
            scenery.source(from_zenith(zenith, 30.0), 100.0);
            let solution = solve(&scenery.scene(), &Settings::default()).solution;
            let small = solution.organs[scenery.organ("leaf small")].absorbed_W;
            // counted in lines of 2.4 mm: half a line along the outline
            assert_within("what leans out", small, 100.0 * 0.12, 100.0 * 1.4 * 0.0012);
            let found = shares(&solution, 0);
            assert_within("all leaves", found.plants, 1.0, 1e-9);
            assert_within("soil under a full plate", found.soil, 0.0, 1e-9);
        }
    }
}

/// Light of the leaves of a small canopy must not jump where rho = tau, or where rho or tau is 0.
#[test]
fn rho_equal_to_tau_and_rho_of_zero_are_nothing_special() {
    let canopy = small_maize();
    let leaf = |rho: f64, tau: f64| (LeafOptics::symmetric(rho, tau), 0.2);
    for (at, near) in [
        (leaf(0.4, 0.4), leaf(0.4 + 1e-7, 0.4 - 1e-7)),
        (leaf(0.0, 0.4), leaf(1e-7, 0.4)),
        (leaf(0.4, 0.0), leaf(0.4, 1e-7)),
        (leaf(0.0, 0.9), leaf(1e-7, 0.9)),
    ] {
        let solved = |leaf| {
            let mut scenery = scenery(&canopy, &[leaf], Vec::new());
            scenery.source(from_zenith(30.0, 70.0), 100.0);
            solve(&scenery.scene(), &by(Estimator::Lines)).solution
        };
        let (at_it, near_it) = (solved(at), solved(near));
        assert_same(&at_it, &near_it, 1e-5);
        assert_within("closure", shares(&at_it, 0).closure, 0.0, 0.003);
    }
}
