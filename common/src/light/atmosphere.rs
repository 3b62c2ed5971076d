//! What reaches the ground on a clear and on an overcast day, where nothing was measured.

use std::f64::consts::TAU;

use super::perez::air_mass;
use super::sun::Sun;

/// Irradiance across the beam outside the atmosphere at the mean distance of the sun, W m⁻²: Kopp & Lean 2011.
const SOLAR_CONSTANT_W_M2: f64 = 1361.0;

/// Irradiance across the beam outside the atmosphere on a day of the year (1 to 366), W m⁻²: Spencer 1971, Search 2:172.
pub fn extraterrestrial_W_m2(day_of_year: u16) -> f64 {
    let angle = TAU * (f64::from(day_of_year) - 1.0) / 365.0;
    let (sin, cos) = angle.sin_cos();
    let (sin_2, cos_2) = (2.0 * angle).sin_cos();
    SOLAR_CONSTANT_W_M2
        * (1.000_110 + 0.034_221 * cos + 0.001_280 * sin + 0.000_719 * cos_2 + 0.000_077 * sin_2)
}

/// Irradiance at the ground, W m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AtGround {
    /// Global, of the horizontal.
    pub ghi_W_m2: f64,
    /// Diffuse, of the horizontal.
    pub dhi_W_m2: f64,
    /// Direct, across the beam.
    pub dni_W_m2: f64,
}

/// A clear sky at sea level, by the turbidity of Linke (1 is a clean, dry atmosphere; 2 cold and clean air, 3 clean and
/// warm, 5 or more haze): Ineichen & Perez 2002, Solar Energy 73:151-157, in the form that pvlib has it (`ineichen`,
/// without its enhancement at high air mass). Nothing where the sun is not up.
pub fn clear(sun: &Sun, turbidity: f64, extraterrestrial_W_m2: f64) -> AtGround {
    if !sun.is_up() {
        return AtGround::default();
    }
    let cos_zenith = sun.towards().z;
    let mass = air_mass(90.0 - sun.elevation_deg);
    // fh1 and fh2 of the paper are 1 at sea level, cg1 is 0.868 and cg2 0.0387
    let ghi_W_m2 = 0.868 * extraterrestrial_W_m2 * cos_zenith * (-0.0387 * mass * turbidity).exp();
    let beam = (0.664 + 0.163) * (-0.09 * mass * (turbidity - 1.0)).exp() * extraterrestrial_W_m2;
    let part = (1.0 - (0.1 - 0.2 * (-turbidity).exp()) / (0.1 + 0.882)).max(0.0);
    let dni_W_m2 = beam.min(ghi_W_m2 * part / cos_zenith);
    AtGround {
        ghi_W_m2,
        dhi_W_m2: ghi_W_m2 - dni_W_m2 * cos_zenith,
        dni_W_m2,
    }
}

/// The same place and time under eight eighths of cloud, all of it diffuse: a quarter of the clear sky's global
/// irradiance, `1 - 0.75 (N / 8)^3.4` of Kasten & Czeplak 1980, Solar Energy 24:177-189, with N = 8.
pub fn overcast(clear: &AtGround) -> AtGround {
    let ghi_W_m2 = 0.25 * clear.ghi_W_m2;
    AtGround {
        ghi_W_m2,
        dhi_W_m2: ghi_W_m2,
        dni_W_m2: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of pvlib's own test of `ineichen`: zenith 10 degrees, air mass 1, turbidity 3, 1364 W m-2 outside. The
    /// air mass of 10 degrees is 1.0151, which changes them by as much as is allowed here.
    #[test]
    fn the_clear_sky_is_that_of_pvlib() {
        let sun = Sun {
            elevation_deg: 80.0,
            azimuth_deg: 0.0,
        };
        let found = clear(&sun, 3.0, 1364.0);
        for (found, of_mass_1, per_mass) in [
            (found.ghi_W_m2, 1_038.159_219, -0.0387 * 3.0),
            (found.dni_W_m2, 942.208_186, -0.09 * 2.0),
        ] {
            let expected = of_mass_1 * f64::exp(per_mass * (air_mass(10.0) - 1.0));
            assert!((found - expected).abs() < 1e-3, "{found} {expected}");
        }
        assert!((air_mass(10.0) - 1.0151).abs() < 1e-3);
    }

    #[test]
    fn parts_are_never_negative_and_add_up() {
        for elevation_deg in [-5.0, 0.0, 0.006, 0.5, 3.0, 10.0, 45.0, 90.0] {
            for turbidity in [1.0, 2.0, 3.0, 7.0, 12.0] {
                let sun = Sun {
                    elevation_deg,
                    azimuth_deg: 0.0,
                };
                let AtGround {
                    ghi_W_m2,
                    dhi_W_m2,
                    dni_W_m2,
                } = clear(&sun, turbidity, 1361.0);
                assert!(dhi_W_m2 >= 0.0 && dni_W_m2 >= 0.0, "{elevation_deg}");
                let sum = dhi_W_m2 + dni_W_m2 * sun.towards().z;
                assert!((sum - ghi_W_m2).abs() <= 1e-9 * ghi_W_m2);
                assert_eq!(ghi_W_m2 > 0.0, sun.is_up());
            }
        }
    }

    #[test]
    fn the_earth_is_nearest_the_sun_in_january() {
        assert!((extraterrestrial_W_m2(3) / SOLAR_CONSTANT_W_M2 - 1.035).abs() < 1e-3);
        assert!((extraterrestrial_W_m2(185) / SOLAR_CONSTANT_W_M2 - 0.967).abs() < 1e-3);
    }
}
