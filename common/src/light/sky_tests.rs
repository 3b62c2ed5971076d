use super::*;
use crate::light::CieType;
use proptest::prelude::*;

fn count(n: usize) -> NonZeroUsize {
    NonZeroUsize::new(n).unwrap()
}

fn clear(diffuse_fraction: f64) -> Sky {
    Sky::Sunny {
        model: SunnySky::Cie(CieType::CLEAR),
        time_utc: "2024-06-21T09:00:00Z".into(),
        latitude_deg: 43.6,
        longitude_deg: 3.9,
        diffuse_fraction,
    }
}

fn sources(sky: Sky, directions: usize, seed: u64) -> Vec<Source> {
    let light = sky.light(vec![100.0]).unwrap();
    light.sources(count(directions), seed).list
}

#[test]
fn a_uniform_sky_brings_sin_squared_from_within_a_zenith_angle() {
    let list = sources(Sky::UniformOvercast, 1000, 3);
    for zenith_deg in [10.0_f64, 30.0, 45.0, 60.0, 80.0] {
        let zenith = zenith_deg.to_radians();
        let within: f64 = list
            .iter()
            .filter(|s| -s.direction.z > zenith.cos())
            .map(|s| s.irradiance_W_m2[0] / 100.0)
            .sum();
        let expected = zenith.sin().powi(2);
        // one band of the sky may fall on either side
        assert!((within - expected).abs() < 2.0 / 1000.0, "{zenith_deg}");
    }
}

#[test]
fn moon_spencer_irradiance_is_7_pi_over_9_of_zenith_radiance() {
    let irradiance: f64 = parts_of_sky(Radiance::MoonSpencer, count(1000), 1)
        .iter()
        .map(|p| p.irradiance)
        .sum();
    assert!((irradiance / (7.0 * PI / 9.0) - 1.0).abs() < 1e-4);
}

/// Values of the CIE formula worked out by hand for the sun at 60° elevation.
#[test]
fn the_clear_sky_has_the_radiance_of_cie_type_12() {
    let at = |elevation_deg: f64, azimuth_deg: f64| {
        let sun = Sun {
            elevation_deg,
            azimuth_deg,
        };
        sun.towards()
    };
    let sky = Radiance::Cie {
        kind: CieType::CLEAR,
        towards_sun: at(60.0, 0.0),
    };
    assert!((sky.towards(DVec3::Z) - 1.0).abs() < 1e-14);
    // phi(0) = 1 - e^-0.32 = 0.273851; f(30°) = 1 + 10 (e^(-pi/2) - e^(-3 pi/2)) + 0.3375 = 3.326467
    // at the sun: phi(30°) = 1 - e^(-0.32 / cos 30°) = 0.308923; f(0) = 11.45 - 0.089833 = 11.360167
    let brightest = sky.towards(at(60.0, 0.0));
    assert!((brightest - 0.308923 * 11.360167 / (0.273851 * 3.326467)).abs() < 1e-4);
    // 90° from the sun at 30° elevation: phi(60°) = 1 - e^-0.64 = 0.472708; f(90°) = 1
    let darker = sky.towards(at(30.0, 180.0));
    assert!((darker - 0.472708 / (0.273851 * 3.326467)).abs() < 1e-5);
}

/// The mean direction of a uniform sky is that of its closed form in every azimuth: 0 sideways,
/// 2/3 upwards.
#[test]
fn directions_are_balanced_in_azimuth() {
    let sum = |list: &[Source]| -> DVec3 {
        list.iter()
            .map(|s| s.direction * s.irradiance_W_m2[0] / 100.0)
            .sum()
    };
    for seed in 0..10 {
        let mean = sum(&sources(Sky::UniformOvercast, 200, seed));
        assert!(mean.x.abs() < 0.01 && mean.y.abs() < 0.01, "{mean}");
        assert!((mean.z + 2.0 / 3.0).abs() < 1e-3, "{mean}");
    }
}

/// The mean over seeds is that of the continuous sky, whatever the number of directions.
#[test]
fn few_directions_are_unbiased() {
    let mut mean = 0.0;
    for seed in 0..4000 {
        mean += sources(Sky::UniformOvercast, 2, seed)
            .iter()
            .map(|s| s.direction.z.powi(2) * s.irradiance_W_m2[0] / 100.0)
            .sum::<f64>()
            / 4000.0;
    }
    assert!((mean - 0.5).abs() < 0.005, "{mean}");
}

#[test]
fn seeds_repeat_and_differ() {
    let list = sources(Sky::StandardOvercast, 46, 7);
    assert_eq!(list, sources(Sky::StandardOvercast, 46, 7));
    let other = sources(Sky::StandardOvercast, 46, 8);
    assert!(
        list.iter()
            .zip(&other)
            .all(|(a, b)| a.direction != b.direction)
    );
}

#[test]
fn what_is_not_there_costs_nothing() {
    assert_eq!(sources(clear(0.0), 46, 1).len(), 1);
    assert_eq!(sources(clear(1.0), 46, 1).len(), 46);
    assert_eq!(sources(clear(0.2), 46, 1).len(), 47);
}

#[test]
fn bad_light_is_refused() {
    for value in [-0.1, 1.1, f64::NAN] {
        assert!(matches!(
            clear(value).resolve(),
            Err(SkyError::DiffuseFraction { .. })
        ));
    }
    for value in [-1.0, f64::INFINITY, f64::NAN] {
        assert!(matches!(
            Sky::UniformOvercast.light(vec![1.0, value]),
            Err(SkyError::Irradiance { .. })
        ));
    }
}

proptest! {
    #[test]
    fn sources_add_up_and_travel_down(
        kind in 0..3,
        directions in 1_usize..300,
        seed: u64,
        diffuse in 0.0..=1.0,
        irradiance in proptest::collection::vec(0.0..2000.0, 1..4),
    ) {
        let sky = match kind {
            0 => Sky::UniformOvercast,
            1 => Sky::StandardOvercast,
            _ => clear(diffuse),
        };
        let light = sky.light(irradiance.clone()).unwrap();
        let list = light.sources(count(directions), seed).list;
        for (band, wanted) in irradiance.iter().enumerate() {
            let sum: f64 = list.iter().map(|s| s.irradiance_W_m2[band]).sum();
            prop_assert!((sum - wanted).abs() <= 1e-13 * wanted);
        }
        for source in &list {
            prop_assert!(source.direction.z < 0.0);
            prop_assert!((source.direction.length() - 1.0).abs() < 1e-14);
            prop_assert!(source.irradiance_W_m2.iter().all(|e| *e >= 0.0));
        }
    }
}

#[test]
fn the_number_of_directions_follows_the_accuracy() {
    for (accuracy_percent, expected) in [
        (0.5, 476),
        (1.0, 200),
        (2.0, 85),
        (50.0, 16),
        (f64::INFINITY, 16),
        (f64::NAN, 16),
        (1e-3, 4000),
        (0.0, 4000),
    ] {
        let found = directions_for(accuracy_percent).get();
        assert_eq!(found, expected, "{accuracy_percent}");
    }
}

/// The sky of Perez of a solve is that of a row of weather with the same irradiances.
#[test]
fn a_sky_of_perez_is_that_of_the_weather() {
    let sky = Sky::Sunny {
        model: SunnySky::Perez { global_W_m2: 800.0 },
        time_utc: "2024-06-21T09:00:00Z".into(),
        latitude_deg: 43.6,
        longitude_deg: 3.9,
        diffuse_fraction: 0.25,
    };
    let light = sky.light(vec![400.0]).unwrap();
    let sun = Sun::at("2024-06-21T09:00:00Z", 43.6, 3.9).unwrap();
    let outside_W_m2 = extraterrestrial_W_m2(173);
    let expected = Perez::of_irradiance(
        sun.towards(),
        (200.0, 600.0 / sun.towards().z),
        outside_W_m2,
    );
    assert_eq!(
        light.sky.as_ref().unwrap().radiance,
        Radiance::Perez(expected)
    );
    assert_eq!(light.suns[0].irradiance_W_m2, [300.0]);
}
