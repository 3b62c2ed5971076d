use super::*;
use crate::light::sun::Sun;

/// At (zenith angle, azimuth from the sun), degrees: the sun itself, behind it, beside it and low.
const LOOKS: [(f64, f64); 4] = [(40.0, 0.0), (30.0, 180.0), (60.0, 90.0), (80.0, 10.0)];

/// Worked out apart from this code (Python) from the six gradations and six indicatrices that Darula & Kittler 2002
/// ("CIE general sky standard defining luminance distributions", eSim) give by group, for the sun 40 degrees from the
/// zenith; table 1 of ISO 15469 names their pairs.
const EXPECTED: [[f64; 4]; 15] = [
    [0.87197, 0.93173, 0.66516, 0.35864],
    [1.61309, 0.66838, 0.48808, 0.35469],
    [0.92830, 0.96150, 0.81785, 0.67657],
    [1.71728, 0.68973, 0.60013, 0.66912],
    [1.00000, 1.00000, 1.00000, 1.00000],
    [1.84992, 0.71735, 0.73378, 0.98898],
    [3.17948, 0.60106, 0.61969, 0.98146],
    [4.72222, 0.50663, 0.52721, 0.97498],
    [2.24003, 0.79715, 1.15714, 2.23928],
    [3.84995, 0.66792, 0.97722, 2.22225],
    [5.71801, 0.56299, 0.83138, 2.20759],
    [5.88805, 0.57152, 0.91004, 2.99643],
    [7.12438, 0.48876, 0.78624, 2.98105],
    [7.29467, 0.49468, 0.84753, 4.02812],
    [7.57111, 0.41047, 0.71660, 4.01364],
];

fn towards(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let sun = Sun {
        elevation_deg: 90.0 - zenith_deg,
        azimuth_deg,
    };
    sun.towards()
}

#[test]
fn the_fifteen_cie_skies_have_the_values_of_their_groups() {
    for (number, expected) in (1..).zip(EXPECTED) {
        let sky = Radiance::Cie {
            kind: CieType::new(number).unwrap(),
            towards_sun: towards(40.0, 0.0),
        };
        assert!((sky.towards(DVec3::Z) - 1.0).abs() < 1e-12);
        for ((zenith, azimuth), expected) in LOOKS.into_iter().zip(expected) {
            let found = sky.towards(towards(zenith, azimuth));
            assert!(
                (found - expected).abs() < 1e-5,
                "type {number}: {found} {expected}"
            );
        }
    }
    assert!(CieType::new(0).is_none() && CieType::new(16).is_none());
}

#[test]
fn cie_skies_are_finite_at_the_horizon() {
    for number in 1..=15 {
        let kind = CieType::new(number).unwrap();
        for sun in [towards(89.99, 30.0), towards(0.0, 0.0), towards(90.0, 90.0)] {
            let sky = Radiance::Cie {
                kind,
                towards_sun: sun,
            };
            for look in [DVec3::X, towards(90.0, 30.0), towards(89.9999, 200.0)] {
                let found = sky.towards(look);
                assert!(found.is_finite() && found >= 0.0, "type {number}: {found}");
            }
        }
    }
}
