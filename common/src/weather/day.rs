//! A day without a weather file: irradiances of a model in place of measured ones.

use jiff::civil::Date;
use jiff::tz::Offset;
use jiff::{SignedDuration, Timestamp};
use thiserror::Error;

use super::Site;
use crate::formats::weather::{Weather, WeatherRow};
use crate::light::SkyModel;
use crate::light::atmosphere::{clear, extraterrestrial_W_m2, overcast};
use crate::light::sun::{Sun, SunError};

/// A day to be made up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Day {
    /// Which one, by the clock of the site's longitude.
    pub date: Date,
    /// Between rows.
    pub every: SignedDuration,
    /// Linke turbidity of the clear sky, 1 or more.
    pub turbidity: f64,
}

/// Why there is no such day.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DayError {
    /// A date at the end of the calendar.
    #[error("date {0}: expected a day from the year -9998 to 9998")]
    Date(Date),
    /// There is no sun to be had.
    #[error(transparent)]
    Sun(#[from] SunError),
}

impl Day {
    /// The least time between rows.
    pub const LEAST: SignedDuration = SignedDuration::from_mins(1);
    /// The most.
    pub const MOST: SignedDuration = SignedDuration::from_hours(6);

    /// Diffuse and direct irradiance from midnight to midnight, by the clock of whole hours that is nearest to the sun at
    /// the site's longitude; times are written with that offset. An overcast sky brings a quarter of a clear one.
    pub fn weather(&self, site: Site, sky: SkyModel) -> Result<Weather, DayError> {
        let hours = (site.longitude_deg / 15.0).round() as i8;
        let refused = |_| DayError::Date(self.date);
        let offset = Offset::from_hours(hours).map_err(refused)?;
        let midnight = self.date.at(0, 0, 0, 0);
        let first = offset.to_timestamp(midnight).map_err(refused)?;
        let last = first
            .checked_add(SignedDuration::from_hours(24))
            .map_err(refused)?;
        let outside_W_m2 = extraterrestrial_W_m2(self.date.day_of_year().unsigned_abs());
        let row = |number: usize, moment: Timestamp| {
            let sun = Sun::by_day_or_night(moment, site.latitude_deg, site.longitude_deg)?;
            let mut ground = clear(&sun, self.turbidity, outside_W_m2);
            if sky.is_overcast() {
                ground = overcast(&ground);
            }
            Ok::<_, SunError>(WeatherRow {
                line: number + 1,
                time: moment.display_with_offset(offset).to_string(),
                moment,
                dhi_W_m2: Some(ground.dhi_W_m2),
                dni_W_m2: Some(ground.dni_W_m2),
                ..WeatherRow::default()
            })
        };
        let mut rows = Vec::new();
        let mut moment = first;
        while moment <= last {
            rows.push(row(rows.len(), moment)?);
            moment = moment.checked_add(self.every).map_err(refused)?;
        }
        Ok(Weather {
            file: format!("the day {}", self.date),
            rows,
            unused: Vec::new(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::CieType;

    const SITE: Site = Site {
        latitude_deg: 43.6,
        longitude_deg: 3.9,
    };

    fn rows(date: &str, minutes: i64, sky: SkyModel) -> Vec<WeatherRow> {
        let day = Day {
            date: date.parse().unwrap(),
            every: SignedDuration::from_mins(minutes),
            turbidity: 3.0,
        };
        day.weather(SITE, sky).unwrap().rows
    }

    #[test]
    fn a_clear_day_goes_from_midnight_to_midnight_and_is_brightest_at_noon() {
        let found = rows("2026-06-21", 30, SkyModel::Cie(CieType::CLEAR));
        assert_eq!(found.len(), 49);
        assert_eq!(found[0].time, "2026-06-21T00:00:00+00:00");
        let dni = |number: usize| found[number].dni_W_m2.unwrap();
        assert_eq!((dni(0), dni(48)), (0.0, 0.0));
        let brightest = (0..49).max_by(|&a, &b| dni(a).total_cmp(&dni(b)));
        // 12:00 by the clock of Greenwich, where the sun is 15.6 minutes early
        assert_eq!(brightest, Some(24));
        // about what is measured there: 8.3 kWh m-2 of global light
        let ghi = |row: &WeatherRow| {
            let sun = Sun::by_day_or_night(row.moment, 43.6, 3.9).unwrap();
            row.dhi_W_m2.unwrap() + row.dni_W_m2.unwrap() * sun.towards().z.max(0.0)
        };
        let day_kWh: f64 = found.iter().map(|row| 0.5e-3 * ghi(row)).sum();
        assert!((7.8..8.8).contains(&day_kWh), "{day_kWh}");
        let dull = rows("2026-06-21", 30, SkyModel::MoonSpencer);
        let dull_kWh: f64 = dull.iter().map(|row| 0.5e-3 * ghi(row)).sum();
        assert!((dull_kWh - 0.25 * day_kWh).abs() < 1e-9);
        assert!(dull.iter().all(|row| row.dni_W_m2 == Some(0.0)));
    }
}
