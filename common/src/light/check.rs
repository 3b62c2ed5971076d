//! What light can be computed with: the one check for light from files, from flags and from clients.

use std::fmt;

use thiserror::Error;

use super::perez::{BRIGHTNESS, CLEARNESS};
use super::radiance::Radiance;
use super::{AN_IRRADIANCE, Light, MIN_DESCENT, POINTS_DOWN, is_irradiance};

/// How much the length of a direction may differ from 1.
const LENGTH: f64 = 1e-9;

/// What the light comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A parallel source, by its number.
    Sun(usize),
    /// The sky without its sun.
    Sky,
    /// All of it.
    All,
}

/// Why a light cannot be computed with.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LightError {
    /// A number of irradiances that is not that of the bands.
    #[error("light of {of}: expected {expected} irradiances, one per band, found {found}")]
    Bands {
        /// Of what.
        of: Origin,
        /// How many bands there are.
        expected: usize,
        /// How many irradiances.
        found: usize,
    },
    /// An irradiance, as it results from what was given.
    #[error("irradiance of {of} in band {band}: expected {AN_IRRADIANCE}, found {found:e}")]
    Irradiance {
        /// Of what.
        of: Origin,
        /// The band's name.
        band: String,
        /// W m⁻².
        found: f64,
    },
    /// A source that does not shine from above.
    #[error("direction of {of}: expected {POINTS_DOWN}, found {} {} {}", found[0], found[1], found[2])]
    Direction {
        /// Of what.
        of: Origin,
        /// In which the light travels.
        found: [f64; 3],
    },
    /// A sky that the model of Perez does not cover.
    #[error("{value} of the sky: expected {least} to {most}, found {found}")]
    Perez {
        /// Which value.
        value: &'static str,
        /// The least that it may be.
        least: f64,
        /// The most that it may be.
        most: f64,
        /// As given.
        found: f64,
    },
    /// A sky that is no part of the light.
    #[error("diffuse fraction: expected above 0 to 1, found {found}")]
    DiffuseFraction {
        /// As given.
        found: f64,
    },
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sun(number) => write!(f, "source {number} (counted from 0)"),
            Self::Sky => f.write_str("the sky"),
            Self::All => f.write_str("all sources together"),
        }
    }
}

impl Light {
    /// Refuses what cannot be computed with, in bands of these names.
    pub fn check<'a>(
        &self,
        bands: impl IntoIterator<Item = &'a str> + Clone,
    ) -> Result<(), LightError> {
        let each = |of: Origin, part: f64, irradiance_W_m2: &[f64]| {
            let (expected, found) = (bands.clone().into_iter().count(), irradiance_W_m2.len());
            if found != expected {
                return Err(LightError::Bands {
                    of,
                    expected,
                    found,
                });
            }
            for (band, &value) in bands.clone().into_iter().zip(irradiance_W_m2) {
                irradiance(of, band, part * value)?;
            }
            Ok(())
        };
        for (number, sun) in self.suns.iter().enumerate() {
            let of = Origin::Sun(number);
            each(of, 1.0, &sun.irradiance_W_m2)?;
            let length = sun.direction.length();
            if !((length - 1.0).abs() <= LENGTH && sun.direction.z <= -MIN_DESCENT) {
                let found = sun.direction.to_array();
                return Err(LightError::Direction { of, found });
            }
        }
        if let Some(sky) = &self.sky {
            let found = sky.diffuse_fraction;
            if !(found > 0.0 && found <= 1.0) {
                return Err(LightError::DiffuseFraction { found });
            }
            each(Origin::Sky, 1.0, &sky.irradiance_W_m2)?;
            each(Origin::Sky, found, &sky.irradiance_W_m2)?;
            if let Some(towards_sun) = sky.radiance.towards_sun()
                && !((towards_sun.length() - 1.0).abs() <= LENGTH && towards_sun.z >= MIN_DESCENT)
            {
                let (of, found) = (Origin::Sky, (-towards_sun).to_array());
                return Err(LightError::Direction { of, found });
            }
            if let Radiance::Perez(perez) = sky.radiance {
                for (value, (least, most), found) in [
                    ("clearness", CLEARNESS, perez.clearness),
                    ("brightness", BRIGHTNESS, perez.brightness),
                ] {
                    if !(least..=most).contains(&found) {
                        return Err(LightError::Perez {
                            value,
                            least,
                            most,
                            found,
                        });
                    }
                }
            }
        }
        for (number, band) in bands.into_iter().enumerate() {
            irradiance(Origin::All, band, self.irradiance_W_m2(number))?;
        }
        Ok(())
    }
}

fn irradiance(of: Origin, band: &str, found: f64) -> Result<(), LightError> {
    if is_irradiance(found) {
        return Ok(());
    }
    Err(LightError::Irradiance {
        of,
        band: band.to_owned(),
        found,
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::light::{SkyLight, Source};

    fn light(sun: f64, sky: f64, diffuse_fraction: f64) -> Light {
        Light {
            suns: vec![Source {
                direction: DVec3::NEG_Z,
                irradiance_W_m2: vec![sun],
            }],
            sky: Some(SkyLight {
                radiance: Radiance::Uniform,
                irradiance_W_m2: vec![sky],
                diffuse_fraction,
            }),
        }
    }

    fn refusal(light: &Light) -> String {
        light.check(["PAR"]).unwrap_err().to_string()
    }

    #[test]
    fn what_results_is_checked_and_not_only_what_was_given() {
        assert_eq!(light(400.0, 100.0, 0.5).check(["PAR"]), Ok(()));
        assert_eq!(light(0.0, 0.0, 1.0).check(["PAR"]), Ok(()));
        let found = refusal(&light(1e100, 1e100, 1.0));
        assert_eq!(
            found,
            "irradiance of all sources together in band PAR: expected 0 or 1e-100 to 1e100, found 2e100"
        );
        for (sun, sky, diffuse, expected) in [
            (1e300, 0.0, 1.0, "irradiance of source 0"),
            (f64::NAN, 0.0, 1.0, "irradiance of source 0"),
            (-1.0, 0.0, 1.0, "irradiance of source 0"),
            (0.0, 1e-101, 1.0, "irradiance of the sky"),
            (0.0, 1.0, 1e-200, "irradiance of the sky"),
            (0.0, 1.0, 0.0, "diffuse fraction"),
            (0.0, 1.0, 1.5, "diffuse fraction"),
            (0.0, 1.0, f64::NAN, "diffuse fraction"),
        ] {
            let found = refusal(&light(sun, sky, diffuse));
            assert!(found.starts_with(expected), "{found}");
        }
    }

    #[test]
    fn directions_are_unit_vectors_from_above() {
        for direction in [
            DVec3::Z,
            DVec3::X,
            DVec3::ZERO,
            DVec3::NEG_Z * 2.0,
            DVec3::new(f64::NAN, 0.0, -1.0),
        ] {
            let mut light = light(1.0, 1.0, 1.0);
            light.suns[0].direction = direction;
            assert!(refusal(&light).starts_with("direction of source 0"));
            light.suns.clear();
            let sky = light.sky.as_mut().unwrap();
            sky.radiance = Radiance::Cie {
                kind: crate::light::CieType::CLEAR,
                towards_sun: -direction,
            };
            assert!(refusal(&light).starts_with("direction of the sky"));
        }
    }

    #[test]
    fn every_source_has_an_irradiance_for_each_band() {
        let found = light(1.0, 1.0, 1.0).check(["PAR", "NIR"]).unwrap_err();
        assert!(found.to_string().contains("expected 2 irradiances"));
    }
}
