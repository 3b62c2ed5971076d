//! A canopy that a master has traced serves other lights.

use std::sync::Arc;

use nestrad_common::light::{Light, Source};
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_tests::calls::{block_on, client, solve};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::Master;
use nestrad_tests::solving;

fn settings() -> Settings {
    Settings {
        accuracy_percent: 4.0,
        ..Settings::default()
    }
}

/// Maize, and the same under a sun that stands lower.
fn two_lights(desk: &Desk) -> [Scene; 2] {
    desk.maize("maize", "1");
    let first = desk.scene("maize/scene.toml");
    let sun = Source {
        direction: glam::DVec3::new(0.8, 0.0, -0.6),
        irradiance_W_m2: vec![200.0, 180.0],
    };
    let light = Light {
        suns: vec![sun],
        sky: None,
    };
    let second = Scene {
        light: Arc::new(light),
        ..first.clone()
    };
    [first, second]
}

/// Solves one light after the other, and says whether each was traced. The results are those of a solve alone.
fn are_traced(desk: &Desk, master: &Master) -> Vec<bool> {
    let scenes = two_lights(desk);
    block_on(async {
        let mut traced = Vec::new();
        for scene in [&scenes[0], &scenes[1], &scenes[0]] {
            let there = solve(client(master), scene.clone(), &settings()).await;
            let here = solving::solve(scene, &settings());
            assert!(there.solution == here.solution);
            let (there, here) = (there.work.jobs, here.work.jobs);
            assert_eq!(there.traced + there.kept, here.traced);
            traced.push(there.traced > 0);
        }
        traced
    })
}

#[test]
fn another_light_of_a_canopy_traces_nothing_and_gives_the_same_bits() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    assert_eq!(are_traced(&desk, &master), [true, false, false]);
    assert_eq!(master.metric("nestrad_traced_canopies"), 1.0);
    let bytes = master.metric("nestrad_traced_canopy_bytes");
    assert!((1e5..2e9).contains(&bytes), "{bytes}");
}

#[test]
fn a_canopy_that_does_not_fit_is_traced_again_and_gives_the_same_bits() {
    let desk = Desk::new();
    for memory in ["0", "0.0005"] {
        let master = Master::start(&["--resident-memory", memory]);
        assert_eq!(are_traced(&desk, &master), [true, true, true]);
        assert_eq!(master.metric("nestrad_traced_canopy_bytes"), 0.0);
    }
}
