//! Where the sun stands, from time and place.

use glam::DVec3;
use jiff::Timestamp;
use jiff::tz::Offset;
use solar_positioning::time::JulianDate;
use solar_positioning::{Location, RefractionCorrection, SolarPositions, delta_t};
use thiserror::Error;
use toml::value::{Date, Datetime, Offset as GivenOffset, Time};

use super::MIN_DESCENT;
use crate::figures::fixed;

/// The apparent position of the sun above the horizon.
///
/// Apparent, because light arrives along the refracted ray: standard refraction at sea level
/// (1013.25 hPa, 15 °C) is included. It lifts the sun by 0.02° at 40° and by 0.5° at the horizon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Above the horizon, degrees; its sine is [`MIN_DESCENT`] or more where it [is up](Self::is_up).
    pub elevation_deg: f64,
    /// From north, clockwise (east is 90), degrees.
    pub azimuth_deg: f64,
}

impl Sun {
    /// The sun at an RFC 3339 time in UTC (`2024-06-21T12:00:00Z` or `+00:00`; seconds and offset may be left out),
    /// at a latitude (north positive) and a longitude (east positive) in degrees.
    ///
    /// Computed with the Solar Position Algorithm (Reda & Andreas 2003, Solar Energy 76:577-589),
    /// good to 0.0003° but for refraction.
    pub fn at(time_utc: &str, latitude_deg: f64, longitude_deg: f64) -> Result<Self, SunError> {
        let refused = |source| SunError::Refused {
            time_utc: time_utc.to_owned(),
            latitude_deg,
            longitude_deg,
            source,
        };
        let sun = stands(julian_date(time_utc)?, latitude_deg, longitude_deg).map_err(refused)?;
        if !sun.is_up() {
            return Err(SunError::TooLow {
                time_utc: time_utc.to_owned(),
                latitude_deg,
                longitude_deg,
                elevation_deg: sun.elevation_deg,
            });
        }
        Ok(sun)
    }

    /// The same at a moment, by day or night: below the horizon its elevation is negative, and so is what
    /// [`MIN_DESCENT`] says of it not true.
    pub fn by_day_or_night(
        moment: Timestamp,
        latitude_deg: f64,
        longitude_deg: f64,
    ) -> Result<Self, SunError> {
        let refused = |source| SunError::Refused {
            time_utc: moment.to_string(),
            latitude_deg,
            longitude_deg,
            source,
        };
        let utc = Offset::UTC.to_datetime(moment);
        let date = (i32::from(utc.year()), utc.month() as u32, utc.day() as u32);
        let time = (utc.hour() as u32, utc.minute() as u32);
        let seconds = f64::from(utc.second()) + 1e-9 * f64::from(utc.subsec_nanosecond());
        julian(date, time, seconds)
            .and_then(|date| stands(date, latitude_deg, longitude_deg))
            .map_err(refused)
    }

    /// Whether it is high enough above the horizon to shine on a canopy.
    pub fn is_up(&self) -> bool {
        self.towards().z >= MIN_DESCENT
    }

    /// The same sun, lifted to the horizon where it stands below: what a sky at dusk is shaped by.
    #[must_use]
    pub fn lifted(self) -> Self {
        if self.is_up() {
            return self;
        }
        Self {
            elevation_deg: (2.0 * MIN_DESCENT).asin().to_degrees(),
            ..self
        }
    }

    /// Unit vector towards the sun, x east, y north, z up.
    pub fn towards(&self) -> DVec3 {
        let (sin_el, cos_el) = self.elevation_deg.to_radians().sin_cos();
        let (sin_az, cos_az) = self.azimuth_deg.to_radians().sin_cos();
        DVec3::new(cos_el * sin_az, cos_el * cos_az, sin_el)
    }
}

/// The day of the year of an RFC 3339 time in UTC, from 1.
pub(super) fn day_of_year(time_utc: &str) -> Result<u16, SunError> {
    let (date, _) = date_and_time(time_utc)?;
    let day = [date.month, date.day].map(|number| i8::try_from(number).ok());
    let [Some(month), Some(day)] = day else {
        return Err(bad_time(time_utc));
    };
    let date = i16::try_from(date.year)
        .ok()
        .map(|year| jiff::civil::Date::new(year, month, day));
    match date {
        Some(Ok(date)) => Ok(date.day_of_year().unsigned_abs()),
        _ => Err(bad_time(time_utc)),
    }
}

fn julian_date(time_utc: &str) -> Result<JulianDate, SunError> {
    let (date, time) = date_and_time(time_utc)?;
    let seconds =
        f64::from(time.second.unwrap_or(0)) + 1e-9 * f64::from(time.nanosecond.unwrap_or(0));
    let date = (i32::from(date.year), date.month.into(), date.day.into());
    let julian = julian(date, (time.hour.into(), time.minute.into()), seconds);
    julian.map_err(|_| bad_time(time_utc))
}

fn bad_time(time_utc: &str) -> SunError {
    SunError::Time {
        given: time_utc.to_owned(),
    }
}

fn date_and_time(time_utc: &str) -> Result<(Date, Time), SunError> {
    let parsed: Datetime = time_utc.trim().parse().map_err(|_| bad_time(time_utc))?;
    let (Some(date), Some(time)) = (parsed.date, parsed.time) else {
        return Err(bad_time(time_utc));
    };
    // a local time in a field that is named UTC is more likely a mistake than a wish
    let utc = [
        None,
        Some(GivenOffset::Z),
        Some(GivenOffset::Custom { minutes: 0 }),
    ];
    if !utc.contains(&parsed.offset) {
        return Err(SunError::NotUtc {
            given: time_utc.to_owned(),
        });
    }
    Ok((date, time))
}

fn julian(
    (year, month, day): (i32, u32, u32),
    (hour, minute): (u32, u32),
    seconds: f64,
) -> Result<JulianDate, solar_positioning::Error> {
    let delta_t_s = delta_t::estimate_from_date(year, month)?;
    JulianDate::from_utc(year, month, day, hour, minute, seconds, delta_t_s)
}

fn stands(
    date: JulianDate,
    latitude_deg: f64,
    longitude_deg: f64,
) -> Result<Sun, solar_positioning::Error> {
    let location = Location {
        latitude: latitude_deg,
        longitude: longitude_deg,
    };
    let refraction = Some(RefractionCorrection::standard());
    let position = SolarPositions::new().at_from_julian(date, location, 0.0, refraction)?;
    Ok(Sun {
        elevation_deg: position.elevation_angle(),
        azimuth_deg: position.azimuth(),
    })
}

/// Why there is no sun to be had.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SunError {
    /// Not a time.
    #[error("time '{given}': expected a date and time in UTC such as 2024-06-21T12:00:00Z")]
    Time {
        /// As given.
        given: String,
    },
    /// A time with an offset from UTC.
    #[error("time '{given}': expected UTC, with Z, +00:00 or nothing at its end")]
    NotUtc {
        /// As given.
        given: String,
    },
    /// A place that is not on the globe, or a time that the algorithm does not cover.
    #[error("sun at {time_utc}, latitude {latitude_deg}, longitude {longitude_deg}: {source}")]
    Refused {
        /// As given.
        time_utc: String,
        /// As given.
        latitude_deg: f64,
        /// As given.
        longitude_deg: f64,
        /// What the solar position algorithm said.
        source: solar_positioning::Error,
    },
    /// It is night, or the moment of sunrise or sunset.
    #[error("{}", too_low(time_utc, *latitude_deg, *longitude_deg, *elevation_deg))]
    TooLow {
        /// As given.
        time_utc: String,
        /// As given.
        latitude_deg: f64,
        /// As given.
        longitude_deg: f64,
        /// Of the sun, less than [`MIN_DESCENT`] wants.
        elevation_deg: f64,
    },
}

fn too_low(time_utc: &str, latitude_deg: f64, longitude_deg: f64, elevation_deg: f64) -> String {
    let where_and_when =
        format!("at {time_utc}, latitude {latitude_deg}, longitude {longitude_deg}");
    let elevation = fixed(elevation_deg, 4);
    if elevation_deg < 0.0 {
        format!(
            "the sun is below the horizon {where_and_when}: its elevation is {elevation} degrees"
        )
    } else {
        format!(
            "the sun is on the horizon {where_and_when}: its elevation is {elevation} degrees, expected 0.0058 \
             or more"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table A5.1 of Reda & Andreas (NREL/TP-560-34302): zenith 50.11162, azimuth 194.34024, for
    /// 820 hPa and 11 °C; at our standard atmosphere refraction is 0.0036° more.
    #[test]
    fn the_published_example_is_met() {
        let sun = Sun::at("2003-10-17T19:30:30Z", 39.742476, -105.1786).unwrap();
        assert!((sun.azimuth_deg - 194.34024).abs() < 3e-4, "{sun:?}");
        assert!(
            (sun.elevation_deg - (90.0 - 50.11162) - 0.0036).abs() < 4e-4,
            "{sun:?}"
        );
    }

    #[test]
    fn noon_sun_of_the_north_stands_in_the_south() {
        let towards = Sun::at("2024-06-21 11:45", 43.6, 3.9).unwrap().towards();
        assert!((towards.length() - 1.0).abs() < 1e-14);
        assert!(towards.y < 0.0 && towards.x.abs() < 0.03);
        let morning = Sun::at("2024-06-21T06:00:00Z", 43.6, 3.9)
            .unwrap()
            .towards();
        assert!(morning.x > 0.5);
    }

    #[test]
    fn night_says_where_and_when() {
        let error = Sun::at("2024-06-21T00:00:00Z", 43.6, 3.9)
            .unwrap_err()
            .to_string();
        for part in ["2024-06-21T00:00:00Z", "43.6", "3.9", "-22.", "below"] {
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn fault_a_sun_on_the_horizon_was_a_beam_without_bounds() {
        // sunrise, by the second: no sun is taken that a .light file could not have
        let mut first = None;
        for second in 0..1200 {
            let (minute, second) = (35 + second / 60, second % 60);
            let time = format!("2024-03-20T05:{minute:02}:{second:02}Z");
            match Sun::at(&time, 43.6, 3.9) {
                Ok(sun) => {
                    assert!(sun.towards().z >= MIN_DESCENT);
                    first = first.or(Some(sun.elevation_deg));
                }
                Err(error) => {
                    assert!(first.is_none(), "{error}");
                    let error = error.to_string();
                    let horizon = ["is on the horizon", "is below the horizon"];
                    assert!(horizon.iter().any(|h| error.contains(h)), "{error}");
                    assert!(!error.contains("-0.0000"), "{error}");
                }
            }
        }
        assert!(first.is_some_and(|elevation| elevation < 0.01), "{first:?}");
        let error = too_low("t", 1.0, 2.0, 0.001);
        let expected = "the sun is on the horizon at t, latitude 1, longitude 2: its elevation is 0.0010 degrees, \
                        expected 0.0058 or more";
        assert_eq!(error, expected);
    }

    #[test]
    fn fault_utc_written_as_an_offset_of_nothing_was_refused() {
        let expected = Sun::at("2024-06-21T12:00:00Z", 43.6, 3.9).unwrap();
        for time in [
            "2024-06-21T12:00:00+00:00",
            "2024-06-21 12:00:00-00:00",
            "2024-06-21t12:00z",
            " 2024-06-21T12:00+00:00 ",
        ] {
            assert_eq!(Sun::at(time, 43.6, 3.9).unwrap(), expected, "{time}");
        }
    }

    #[test]
    fn bad_times_and_places_are_refused() {
        for bad in [
            "",
            "noon",
            "2024-06-21",
            "12:00:00",
            "2024-02-30T12:00:00Z",
            "2024-13-01T12:00:00Z",
            "2024-06-21T25:00:00Z",
            "2024-06-21T12:00:00Zulu",
        ] {
            assert!(
                matches!(Sun::at(bad, 0.0, 0.0), Err(SunError::Time { .. })),
                "{bad}"
            );
        }
        assert!(matches!(
            Sun::at("2024-06-21T12:00:00+02:00", 0.0, 0.0),
            Err(SunError::NotUtc { .. })
        ));
        for (latitude, longitude) in [(91.0, 0.0), (f64::NAN, 0.0), (0.0, 181.0)] {
            assert!(matches!(
                Sun::at("2024-06-21T12:00:00Z", latitude, longitude),
                Err(SunError::Refused { .. })
            ));
        }
    }
}
