//! A canopy that stays serves one light after the other.

use nestrad_common::scene::Scene;
use nestrad_engine::exchange::ThisProcess;
use nestrad_engine::plan::Settings;
use nestrad_engine::resident::Resident;
use nestrad_engine::rounds::{self, light_in_rounds};
use nestrad_engine::stopwatch::Stopwatch;
use nestrad_tests::solving::{coarse, finish, unwatched};

use super::{maize, overcast_maize};

/// Solves by the default settings of `coarse`, with a canopy that may be resident.
fn light(scene: &Scene, settings: &Settings, resident: &mut Resident) -> rounds::Solved {
    let (rows, watch) = (ThisProcess::default(), &mut Stopwatch::start());
    unwatched(|run| {
        light_in_rounds(
            (scene, &mut *resident),
            settings,
            &rows,
            run,
            watch,
            |_, _| (),
        )
    })
    .unwrap()
}

/// The same canopy under another light.
fn under(scene: &Scene, other: &Scene) -> Scene {
    Scene {
        optics: other.optics.clone(),
        light: other.light.clone(),
        ..scene.clone()
    }
}

fn every_light_of_a_resident_canopy_gives_the_bits_of_its_plan_alone(
    settings: &Settings,
    resident: &mut Resident,
) {
    let day = maize();
    let lights = [day.clone(), under(&day, &overcast_maize()), day.clone()];
    let mut traced = Vec::new();
    for scene in &lights {
        let solved = light(scene, settings, resident);
        traced.push(solved.work.jobs.traced);
        assert!(solved.solution == finish(scene, &solved.plan).unwrap().solution);
    }
    assert!(traced[0] > 0);
    assert_eq!(traced[1..], [0, 0]);
}

#[test]
fn a_resident_canopy_traces_nothing_for_another_light() {
    let resident = &mut Resident::within(1 << 30);
    every_light_of_a_resident_canopy_gives_the_bits_of_its_plan_alone(&coarse(), resident);
}

#[test]
fn a_resident_canopy_begins_as_finely_as_its_rounds_have_ended() {
    let settings = Settings {
        accuracy_percent: 3.0,
        in_rounds: true,
        ..Settings::default()
    };
    let resident = &mut Resident::within(1 << 30).going_on();
    every_light_of_a_resident_canopy_gives_the_bits_of_its_plan_alone(&settings, resident);
}

/// A master must give the same bits whatever it has solved before.
#[test]
fn rounds_that_do_not_go_on_have_the_bits_of_a_solve_alone() {
    let day = maize();
    let resident = &mut Resident::within(1 << 30);
    for (scene, accuracy_percent) in [(&day, 3.0), (&under(&day, &overcast_maize()), 1.0)] {
        let settings = Settings {
            accuracy_percent,
            in_rounds: true,
            ..Settings::default()
        };
        for _ in 0..2 {
            let again = light(scene, &settings, resident);
            let alone = light(scene, &settings, &mut Resident::within(0));
            assert!(again.solution == alone.solution);
            assert_eq!(again.accuracy, alone.accuracy);
        }
    }
}

#[test]
fn a_canopy_that_there_is_no_room_for_is_traced_anew_with_the_same_bits() {
    let day = maize();
    let [wide, narrow] = [1 << 30, 1 << 10].map(|bytes| {
        let resident = &mut Resident::within(bytes);
        [0, 1].map(|_| light(&day, &coarse(), resident))
    });
    assert!(wide[1].work.jobs.traced == 0 && narrow[1].work.jobs.traced > 0);
    assert!(wide[1].solution == narrow[1].solution);
}
