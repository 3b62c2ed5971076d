//! From weather to light: one light for each row, checked against where the sun stands.

mod day;

use std::collections::BTreeMap;

use jiff::tz::Offset;
use jiff::{SignedDuration, Timestamp};
use thiserror::Error;

use crate::formats::weather::{BandIrradiance, Weather, WeatherRow};
use crate::formats::{FormatError, Place};
use crate::light::atmosphere::extraterrestrial_W_m2;
use crate::light::perez::Perez;
use crate::light::sun::{Sun, SunError};
use crate::light::{Light, Radiance, SkyLight, SkyModel, Source};

pub use day::{Day, DayError};

/// Where the weather was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Degrees, north positive, -90 to 90.
    pub latitude_deg: f64,
    /// Degrees, east positive, -180 to 180.
    pub longitude_deg: f64,
}

/// A row of the weather as light.
#[derive(Clone, Debug, PartialEq)]
pub struct Moment {
    /// Line of the weather file, counted from 1.
    pub line: usize,
    /// As the file has it.
    pub time: String,
    /// The sun, by day or night.
    pub sun: Sun,
    /// What comes from above; `None` where nothing does in any band.
    pub light: Option<Light>,
    /// The time that it stands for in a sum over the series, s: half of that to the row before and half of that to the
    /// next, so that sums are those of the trapezoidal rule. Nights that were left out count as rows of 0.
    pub weight_s: f64,
}

/// Why weather cannot be made light.
#[derive(Debug, Error)]
pub enum WeatherError {
    /// A row that cannot be.
    #[error(transparent)]
    Row(#[from] FormatError),
    /// Nothing says what a band gets.
    #[error(
        "band {band}: expected columns direct_{band}_W_m2 and diffuse_{band}_W_m2 in {file}, or which part of the \
         broadband irradiance it is (--band-fraction {band}=0.5, or band_fraction in [light])"
    )]
    NoIrradiance {
        /// The band's name.
        band: String,
        /// The weather file.
        file: String,
    },
    /// A part that is none.
    #[error(
        "band fraction of {band}: expected above 0 to 1 and the name of a band ({bands}), found {found}"
    )]
    Fraction {
        /// As given.
        band: String,
        /// The bands that there are.
        bands: String,
        /// As given.
        found: f64,
    },
    /// The sky of Perez follows from broadband irradiance.
    #[error(
        "{file}: expected two of ghi_W_m2, dhi_W_m2 and dni_W_m2 for a sky of Perez, found columns of bands alone"
    )]
    NoBroadband {
        /// The weather file.
        file: String,
    },
    /// There is no sun to be had.
    #[error(transparent)]
    Sun(#[from] SunError),
}

/// Rows that are missing in a night are looked at one by one: more than these are a gap.
const MOST_MISSING: i128 = 100_000;

/// How weather becomes light.
#[derive(Clone, Copy, Debug)]
pub struct ToLight<'a> {
    /// Where it was.
    pub site: Site,
    /// How diffuse light is distributed.
    pub sky: SkyModel,
    /// Names of the bands.
    pub bands: &'a [String],
    /// Which part of broadband irradiance a band gets, of direct and diffuse light alike, above 0 to 1.
    pub band_fraction: &'a BTreeMap<String, f64>,
}

impl ToLight<'_> {
    /// The light of every row.
    pub fn moments(&self, weather: &Weather) -> Result<Vec<Moment>, WeatherError> {
        for (band, &found) in self.band_fraction {
            if !(found > 0.0 && found <= 1.0 && self.bands.contains(band)) {
                return Err(WeatherError::Fraction {
                    band: band.clone(),
                    bands: self.bands.join(", "),
                    found,
                });
            }
        }
        let weights_s = self.weights_s(weather)?;
        let rows = weather.rows.iter().zip(weights_s);
        let moments = rows.map(|(row, weight_s)| {
            let sun = self.sun(row.moment)?;
            let light = self.light(weather, row, sun)?;
            Ok(Moment {
                line: row.line,
                time: row.time.clone(),
                sun,
                light,
                weight_s,
            })
        });
        moments.collect()
    }

    fn sun(&self, moment: Timestamp) -> Result<Sun, SunError> {
        Sun::by_day_or_night(moment, self.site.latitude_deg, self.site.longitude_deg)
    }

    /// The time that each row stands for. Rows follow each other at the smallest spacing that there is; one that is
    /// missing is a gap, but by night.
    fn weights_s(&self, weather: &Weather) -> Result<Vec<f64>, WeatherError> {
        let rows = &weather.rows;
        let between = |pair: &[WeatherRow]| pair[0].moment.duration_until(pair[1].moment);
        let spacing = rows.windows(2).map(between).min().unwrap_or_default();
        let mut weights_s = vec![0.0; rows.len()];
        for (number, pair) in rows.windows(2).enumerate() {
            let apart = between(pair);
            if apart > spacing {
                self.check_night(weather, pair, spacing)?;
            }
            // to the next row, or to a row of 0 beside it
            let half_s = 0.5 * apart.min(spacing).as_secs_f64();
            weights_s[number] += half_s;
            weights_s[number + 1] += half_s;
        }
        Ok(weights_s)
    }

    /// Refuses rows that are missing while the sun is up.
    fn check_night(
        &self,
        weather: &Weather,
        pair: &[WeatherRow],
        spacing: SignedDuration,
    ) -> Result<(), WeatherError> {
        let (before, after) = (&pair[0], &pair[1]);
        let gap = |missing: Timestamp| {
            let minutes = spacing.as_secs_f64() / 60.0;
            FormatError::Content {
                place: Place::line(&weather.file, after.line),
                expected: format!(
                    "a row at {missing}, {minutes} minutes after another, as the sun is up then (rows of a night may be missing)"
                ),
                found: format!("{}, after {}", after.time, before.time),
            }
        };
        let apart = before.moment.duration_until(after.moment);
        let missing = apart.as_nanos() / spacing.as_nanos().max(1);
        let mut moment = before.moment;
        for number in 1..=missing {
            let Ok(next) = moment.checked_add(spacing) else {
                return Ok(());
            };
            moment = next;
            if moment >= after.moment {
                break;
            }
            if number > MOST_MISSING || self.sun(moment)?.is_up() {
                return Err(gap(moment).into());
            }
        }
        Ok(())
    }

    fn light(
        &self,
        weather: &Weather,
        row: &WeatherRow,
        sun: Sun,
    ) -> Result<Option<Light>, WeatherError> {
        let broadband = broadband(weather, row, &sun)?;
        let mut direct_W_m2 = Vec::with_capacity(self.bands.len());
        let mut diffuse_W_m2 = Vec::with_capacity(self.bands.len());
        for band in self.bands {
            let own = row.bands.get(band).copied();
            let part = self.band_fraction.get(band);
            let of_part = broadband.zip(part).map(|(whole, part)| BandIrradiance {
                direct_W_m2: part * whole.direct_W_m2,
                diffuse_W_m2: part * whole.diffuse_W_m2,
            });
            let Some(irradiance) = own.or(of_part) else {
                return Err(WeatherError::NoIrradiance {
                    band: band.clone(),
                    file: weather.file.clone(),
                });
            };
            if irradiance.direct_W_m2 > 0.0 && !sun.is_up() {
                return Err(below(weather, row, &sun, irradiance.direct_W_m2).into());
            }
            direct_W_m2.push(irradiance.direct_W_m2);
            diffuse_W_m2.push(irradiance.diffuse_W_m2);
        }
        let radiance = match self.sky {
            SkyModel::Uniform => Radiance::Uniform,
            SkyModel::MoonSpencer => Radiance::MoonSpencer,
            SkyModel::Cie(kind) => Radiance::Cie {
                kind,
                towards_sun: sun.lifted().towards(),
            },
            SkyModel::Perez => {
                let Some(whole) = broadband else {
                    return Err(WeatherError::NoBroadband {
                        file: weather.file.clone(),
                    });
                };
                Radiance::Perez(perez(row, sun, whole))
            }
        };
        let shines = |irradiance_W_m2: &[f64]| irradiance_W_m2.iter().any(|&value| value > 0.0);
        let light = Light {
            suns: Vec::from_iter(shines(&direct_W_m2).then(|| Source {
                direction: -sun.towards(),
                irradiance_W_m2: direct_W_m2,
            })),
            sky: shines(&diffuse_W_m2).then_some(SkyLight {
                radiance,
                irradiance_W_m2: diffuse_W_m2,
                diffuse_fraction: 1.0,
            }),
        };
        if light.is_dark() {
            return Ok(None);
        }
        let checked = light.check(self.bands.iter().map(String::as_str));
        checked.map_err(|fault| FormatError::Scene {
            place: Place::line(&weather.file, row.line),
            message: fault.to_string(),
        })?;
        Ok(Some(light))
    }
}

/// The sky of a row.
fn perez(row: &WeatherRow, sun: Sun, whole: BandIrradiance) -> Perez {
    let day = Offset::UTC.to_datetime(row.moment).day_of_year();
    let outside_W_m2 = extraterrestrial_W_m2(day.unsigned_abs());
    let horizontal = (whole.direct_W_m2, whole.diffuse_W_m2);
    Perez::of_horizontal(sun.lifted().towards(), horizontal, outside_W_m2)
}

/// Direct and diffuse irradiance of the horizontal over all wavelengths, if the row has them. Where it has three values,
/// diffuse and direct light are those that count.
fn broadband(
    weather: &Weather,
    row: &WeatherRow,
    sun: &Sun,
) -> Result<Option<BandIrradiance>, FormatError> {
    let fault = |expected: String, found: String| FormatError::Content {
        place: Place::line(&weather.file, row.line),
        expected,
        found,
    };
    if let (Some(ghi), Some(dhi)) = (row.ghi_W_m2, row.dhi_W_m2)
        && dhi > ghi
    {
        let expected = format!("DHI of at most GHI, {ghi} W m-2");
        return Err(fault(expected, format!("{dhi} W m-2")));
    }
    let of_beam = |dni: f64| {
        if dni > 0.0 && !sun.is_up() {
            return Err(below(weather, row, sun, dni));
        }
        Ok(dni * sun.towards().z.max(0.0))
    };
    let (direct_W_m2, diffuse_W_m2) = match (row.ghi_W_m2, row.dhi_W_m2, row.dni_W_m2) {
        (_, Some(dhi), Some(dni)) => (of_beam(dni)?, dhi),
        (Some(ghi), Some(dhi), None) => (ghi - dhi, dhi),
        (Some(ghi), None, Some(dni)) => {
            let direct = of_beam(dni)?;
            if direct > ghi {
                let expected =
                    format!("direct light on the horizontal of at most GHI, {ghi} W m-2");
                let elevation = sun.elevation_deg;
                let found = format!(
                    "{direct:.3} W m-2 (DNI {dni} W m-2, the sun {elevation:.3} degrees above the horizon)"
                );
                return Err(fault(expected, found));
            }
            (direct, ghi - direct)
        }
        _ => return Ok(None),
    };
    if direct_W_m2 > 0.0 && !sun.is_up() {
        return Err(below(weather, row, sun, direct_W_m2));
    }
    Ok(Some(BandIrradiance {
        direct_W_m2,
        diffuse_W_m2,
    }))
}

/// Direct light, and no sun.
fn below(weather: &Weather, row: &WeatherRow, sun: &Sun, direct_W_m2: f64) -> FormatError {
    FormatError::Content {
        place: Place::line(&weather.file, row.line),
        expected: format!(
            "no direct light at {}, as the sun stands at {:.2} degrees, not above the horizon (is the offset of the time right?)",
            row.time, sun.elevation_deg
        ),
        found: format!("{direct_W_m2} W m-2"),
    }
}

#[cfg(test)]
mod tests;
