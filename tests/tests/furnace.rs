//! Closed enclosures (DESIGN, section 7): with emission E everywhere and reflectance rho everywhere,
//! every face has radiosity E / (1 - rho), whatever the shape and however it is sampled. A line that
//! slipped through a seam, or a row without samples, would show.

#![allow(clippy::unwrap_used)]

use std::thread;
use std::time::Duration;

use glam::{DVec2, DVec3};
use nestrad_common::optics::{FaceOptics, LeafOptics};
use nestrad_engine::exchange::Outlook;
use nestrad_engine::solver::{Groups, Irradiance, SolverError, System, Tolerance, solve};
use nestrad_engine::stop::Stop;
use nestrad_kernel::ends::Side;
use nestrad_tests::enclosure::{closed_box, sphere};
use nestrad_tests::form_factor::Traced;
use nestrad_tests::scenery::Scenery;
use nestrad_tests::solving::{ESTIMATORS, sampling};
use nestrad_tests::statistics::assert_within;

/// Solves with unit light on all `lit` rows; returns the irradiance of every row.
///
/// All light that reaches a face counts, so unit irradiance everywhere is what unit emission of
/// everything brings: E = 1 + rho E.
fn heated(scenery: &Scenery, traced: &Traced, lit: &[usize]) -> Vec<f64> {
    let tolerance = Tolerance {
        absorbed: 1e-7,
        most_passes: 1000,
    };
    let irradiance = solved(scenery, traced, lit, &tolerance, &Stop::default()).unwrap();
    (0..traced.frame.rows())
        .map(|row| irradiance.mean(row, 0))
        .collect()
}

fn solved(
    scenery: &Scenery,
    traced: &Traced,
    lit: &[usize],
    tolerance: &Tolerance,
    stop: &Stop,
) -> Result<Irradiance, SolverError> {
    let (frame, exchange) = (&traced.frame, &traced.exchange);
    let mut direct = vec![0.0; frame.rows()];
    for &row in lit {
        direct[row] = 1.0;
    }
    let fixed = vec![0.0; frame.ends.len() - frame.rows()];
    let system = System {
        frame,
        optics: &frame.ordered(&scenery.scene().optics),
        exchange,
        outlook: &Outlook::of(frame, exchange),
        groups: &Groups::of(frame),
        far: None,
        direct_W_m2: &direct,
        fixed_W_m2: &fixed,
        incoming_W: &[1.0],
        far_sample: None,
    };
    solve(&system, &[0], tolerance, stop)
}

#[test]
fn what_is_cancelled_stops_at_the_next_pass() {
    let mut scenery = sphere(2);
    scenery.band("B", 0.0, &[("wall", LeafOptics::opaque(0.9))]);
    let traced = Traced::new(&scenery.canopy(), 0.2, &sampling(ESTIMATORS[0], 0.02, 40.0));
    let rows: Vec<usize> = (0..traced.frame.rows()).collect();
    // nothing is ever as good as this: the passes have no other end
    let never = Tolerance {
        absorbed: -1.0,
        most_passes: u32::MAX,
    };
    let stop = Stop::default();
    let stopped = thread::scope(|scope| {
        scope.spawn(|| {
            thread::sleep(Duration::from_millis(50));
            stop.stop();
        });
        solved(&scenery, &traced, &rows, &never, &stop)
    });
    assert!(matches!(stopped, Err(SolverError::Stopped(_))));
    // and what is told so beforehand does not begin
    let stopped = solved(&scenery, &traced, &rows, &never, &stop);
    assert!(matches!(stopped, Err(SolverError::Stopped(_))));
}

#[test]
fn in_a_furnace_every_wall_is_equally_bright() {
    let mut cube = Scenery::open();
    closed_box(&mut cube, DVec3::ZERO, DVec3::new(1.0, 0.7, 0.4));
    for (name, mut scenery, side) in [
        ("box", cube, Side::Upper),
        ("sphere", sphere(3), Side::Lower),
    ] {
        for rho in [0.2, 0.5, 0.9] {
            scenery.bands.clear();
            scenery.band("B", 0.0, &[("wall", LeafOptics::opaque(rho))]);
            for estimator in ESTIMATORS {
                let traced = Traced::new(&scenery.canopy(), 0.2, &sampling(estimator, 0.02, 40.0));
                let inside: Vec<usize> = (0..scenery.organs.len())
                    .flat_map(|organ| traced.rows(organ, side))
                    .collect();
                let irradiance = heated(&scenery, &traced, &inside);
                for &row in &inside {
                    let what = format!("{name}, rho {rho}, {estimator:?}, row {row}");
                    // emission and what is reflected
                    let radiosity = 1.0 + rho * irradiance[row];
                    assert_within(&what, radiosity, 1.0 / (1.0 - rho), 1e-5 / (1.0 - rho));
                }
            }
        }
    }
}

/// Leaves in the furnace, with other properties on each face, but the same rho of the lower face plus
/// tau of the upper one: then what leaves a face is the same fraction of the same light everywhere.
#[test]
fn two_sided_leaves_in_a_furnace_are_as_bright_as_its_walls() {
    let mut scenery = Scenery::open();
    closed_box(&mut scenery, DVec3::ZERO, DVec3::ONE);
    scenery.level("leaf 1", DVec3::new(0.2, 0.1, 0.5), DVec2::new(0.5, 0.6));
    // crosses the first one
    let at = |x: f64, z: f64| DVec3::new(x, 0.3 + 0.1 * x, z);
    scenery.quad(
        "leaf 2",
        [at(0.3, 0.2), at(0.9, 0.2), at(0.9, 0.9), at(0.3, 0.9)],
    );
    let scattered = 0.8;
    // leaves the upper face: rho of the upper, tau of the lower; and the other way round
    let leaf = LeafOptics {
        upper: FaceOptics { rho: 0.5, tau: 0.2 },
        lower: FaceOptics { rho: 0.6, tau: 0.3 },
    };
    scenery.band(
        "B",
        0.0,
        &[("wall", LeafOptics::opaque(scattered)), ("leaf", leaf)],
    );
    for estimator in ESTIMATORS {
        let traced = Traced::new(&scenery.canopy(), 0.2, &sampling(estimator, 0.02, 40.0));
        let mut lit: Vec<usize> = (0..6).flat_map(|o| traced.rows(o, Side::Upper)).collect();
        for leaf in [6, 7] {
            lit.extend(traced.rows(leaf, Side::Upper));
            lit.extend(traced.rows(leaf, Side::Lower));
        }
        let irradiance = heated(&scenery, &traced, &lit);
        for &row in &lit {
            let what = format!("{estimator:?}, row {row}");
            assert_within(&what, irradiance[row], 1.0 / (1.0 - scattered), 1e-4);
        }
    }
}
