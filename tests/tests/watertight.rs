//! A closed mesh lets nothing through, in either estimator, at any offset. `cargo run --release -p
//! nestrad-tests --bin leaks` counts more; rays exactly through edges and corners are tested in the worker.

use nestrad_engine::plan::Estimator;
use nestrad_tests::leaks::{OFFSETS_M, of_sphere};

#[test]
fn nothing_is_seen_through_a_closed_mesh() {
    for offset_m in OFFSETS_M {
        for (estimator, effort) in [(Estimator::Lines, 0.03), (Estimator::Rays, 8.0)] {
            let found = of_sphere(offset_m, estimator, effort, 1);
            assert!(found.looks > 60_000, "{found:?}");
            assert_eq!(found.leaks, 0, "{estimator:?} at {offset_m}: {found:?}");
        }
    }
}
