//! Wild scenes (`random::wild`): those that the fuzzer found something with, by seed, and a few hundred
//! as they come.

use nestrad_tests::extremes::run;
use nestrad_tests::extremes::wild::case;

fn holds(seed: u64) {
    let row = run(case(seed));
    assert!(row.verdict.is_ok(), "seed {seed}: {:?}", row.verdict);
}

/// A sun at 89.99° across an open scene: ten thousand times the points that were planned.
#[test]
fn a_low_sun_across_the_corner_of_an_open_scene_takes_bounded_time() {
    holds(13);
}

/// A pattern a thousand times as long as it is wide: a source's lattice had no column, and a panic.
#[test]
fn a_pattern_narrower_than_a_step_of_the_lattice_is_lit() {
    holds(1_000_019);
}

#[test]
fn wild_scenes_are_solved_soundly_or_refused() {
    (0..40).for_each(holds);
}
