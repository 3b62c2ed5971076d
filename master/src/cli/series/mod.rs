//! `nestrad series` and `nestrad day`: one canopy under the light of many moments.

mod pace;
mod record;
mod source;
mod sums;
mod task;

use std::collections::BTreeMap;
use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use jiff::SignedDuration;
use jiff::civil::Date;
use nestrad_common::assemble::load_weather;
use nestrad_common::formats::weather::Weather;
use nestrad_common::light::SkyModel;
use nestrad_common::options::{Diameter, Options, TableFormat};
use nestrad_common::weather::{Day, Site};
use nestrad_engine::plan::Estimator;

use super::console::Notes;
use super::flags::{CanopyFlags, named_number, once, sky_model};
use super::numbers::{number, positive, whole};
use super::pool::pool;
use super::settings::settings;
use source::Source;
pub(super) use task::SeriesMemory;
use task::Task;

/// Compute the light of a canopy at every row of a weather file: a day, a season
///
/// The canopy is traced once, and lit again for every row. Writes series, balance, integrals, plants and species (.csv or
/// .parquet) and summary.json into DIR; after an error DIR is unchanged. A series that was stopped goes on where it ended
/// when it is started again with the same input.
///
/// The weather file is CSV with a header: a column time (ISO 8601 with its offset from UTC), and two of ghi_W_m2,
/// dhi_W_m2 and dni_W_m2, or for each band direct_BAND_W_m2 and diffuse_BAND_W_m2 of the horizontal. Exit codes are those
/// of solve.
#[derive(Debug, Args)]
pub(crate) struct SeriesArgs {
    #[command(flatten)]
    canopy: CanopyFlags,

    /// The weather, a CSV file (.csv, plain or .gz)
    #[arg(long, value_name = "FILE", help_heading = "What to compute")]
    weather: PathBuf,

    #[command(flatten)]
    site: SiteFlags,

    #[command(flatten)]
    how: HowFlags,
}

/// Compute the light of a canopy over one clear or overcast day, without a weather file
///
/// As series does, with irradiance of a model: on a clear day that of Ineichen and Perez 2002 at sea level, by --turbidity;
/// under an overcast sky (standard-overcast, uniform-overcast, cie-1 to cie-5) a quarter of it, all diffuse. The day goes
/// from midnight to midnight by the whole hour that is nearest to the sun at --longitude.
#[derive(Debug, Args)]
pub(crate) struct DayArgs {
    #[command(flatten)]
    canopy: CanopyFlags,

    /// The day, such as 2026-06-21
    #[arg(long, value_name = "DATE", value_parser = date, help_heading = "What to compute")]
    date: Date,

    /// Time between moments, such as 30min or 1h: 1min to 6h
    #[arg(long, value_name = "TIME", default_value = "1h", value_parser = every, help_heading = "What to compute")]
    every: SignedDuration,

    /// Linke turbidity of the clear sky: 2 cold and clean air, 3 warm, 5 and more haze
    #[arg(long, value_name = "NUMBER", default_value_t = 3.0, value_parser = turbidity, help_heading = "What to compute")]
    turbidity: f64,

    #[command(flatten)]
    site: SiteFlags,

    #[command(flatten)]
    how: HowFlags,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "What to compute")]
struct SiteFlags {
    /// Degrees, north positive
    #[arg(long, value_name = "DEGREES", value_parser = latitude, allow_negative_numbers = true)]
    latitude: f64,

    /// Degrees, east positive
    #[arg(long, value_name = "DEGREES", value_parser = longitude, allow_negative_numbers = true)]
    longitude: f64,

    /// How diffuse light is distributed: perez, cie-1 to cie-15, clear (cie-12), standard-overcast or uniform-overcast
    #[arg(long, value_name = "SKY", value_parser = sky_model)]
    sky: SkyModel,

    /// Which part of broadband irradiance a band gets, direct and diffuse alike; once for each band
    ///
    /// There is no default. Of sunlight at the ground, about 0.45 is PAR (400 to 700 nm) and 0.5 is near infrared.
    #[arg(long, value_name = "NAME=PART", value_parser = named_number)]
    band_fraction: Vec<(String, f64)>,
}

#[derive(Debug, Args)]
#[command(next_help_heading = "How to compute it")]
struct HowFlags {
    /// As for solve: auto, inf or metres [default: auto]
    #[arg(long, value_name = "auto|inf|METRES", allow_negative_numbers = true)]
    diameter: Option<Diameter>,

    /// Target error of the brightest moment, percent, bias included; what it needs serves all moments [default: 0.5]
    #[arg(long, value_name = "PERCENT", value_parser = positive, allow_negative_numbers = true)]
    accuracy: Option<f64>,

    /// Memory that it may take, GiB [default: 8]
    #[arg(long, value_name = "GIB", value_parser = positive, allow_negative_numbers = true)]
    memory: Option<f64>,

    /// Number of threads, 0 for one per processor, at most 4 for each; results do not depend on it [default: 0]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(0..=4096), allow_negative_numbers = true)]
    threads: Option<usize>,

    /// Start of all random numbers; the same seed gives the same results to the last bit [default: 1]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(0..=u64::MAX), allow_negative_numbers = true)]
    seed: Option<u64>,

    /// Folder for the results; created if it does not exist. Files of an earlier result are replaced
    #[arg(long, value_name = "DIR", help_heading = "Results")]
    out: PathBuf,

    /// Form of the result tables: csv or parquet [default: csv]
    #[arg(long, value_name = "FORM", help_heading = "Results")]
    format: Option<TableFormat>,

    /// Print errors only: no plan, no progress, no table
    #[arg(long, short, help_heading = "Results")]
    quiet: bool,
}

impl SeriesArgs {
    pub(crate) fn run(self) -> Result<()> {
        let weather = load_weather(&self.weather)?;
        let path = std::path::absolute(&self.weather).unwrap_or(self.weather);
        let source = Source::File(path.display().to_string());
        carry_out(&self.canopy, self.site, self.how, (weather, source))
    }
}

impl DayArgs {
    pub(crate) fn run(self) -> Result<()> {
        let day = Day {
            date: self.date,
            every: self.every,
            turbidity: self.turbidity,
        };
        let weather = day.weather(self.site.place(), self.site.sky)?;
        let source = Source::Day {
            date: self.date.to_string(),
            every_s: self.every.as_secs_f64(),
            turbidity: self.turbidity,
            model: "clear: Ineichen & Perez 2002 at sea level; overcast: a quarter of it (Kasten & Czeplak 1980)",
        };
        carry_out(&self.canopy, self.site, self.how, (weather, source))
    }
}

impl SiteFlags {
    fn place(&self) -> Site {
        Site {
            latitude_deg: self.latitude,
            longitude_deg: self.longitude,
        }
    }
}

fn carry_out(
    canopy: &CanopyFlags,
    site: SiteFlags,
    how: HowFlags,
    (weather, source): (Weather, Source),
) -> Result<()> {
    let place = site.place();
    let band_fraction: BTreeMap<String, f64> = once("--band-fraction", site.band_fraction)?;
    let options = Options {
        diameter: how.diameter,
        accuracy_percent: how.accuracy,
        memory_GiB: how.memory,
        threads: how.threads,
        seed: how.seed,
        format: how.format,
        vtp: None,
    };
    let inputs = canopy.inputs(None, band_fraction, options)?;
    let task = Task {
        settings: settings(&inputs.options, None, Estimator::default()),
        notes: Notes { quiet: how.quiet },
        inputs,
        weather,
        source,
        place,
        sky: site.sky,
        out: how.out,
    };
    pool(task.inputs.options.threads, task.notes)?.install(|| task.carry_out())
}

fn date(text: &str) -> Result<Date, String> {
    text.parse()
        .map_err(|_| "expected a day such as 2026-06-21".to_owned())
}

fn every(text: &str) -> Result<SignedDuration, String> {
    let time = text.parse().ok();
    let range = Day::LEAST..=Day::MOST;
    time.filter(|time| range.contains(time))
        .ok_or_else(|| "expected a time such as 30min or 1h, from 1min to 6h".to_owned())
}

fn turbidity(text: &str) -> Result<f64, String> {
    within(text, 1.0, 20.0)
}

fn latitude(text: &str) -> Result<f64, String> {
    within(text, -90.0, 90.0)
}

fn longitude(text: &str) -> Result<f64, String> {
    within(text, -180.0, 180.0)
}

fn within(text: &str, low: f64, high: f64) -> Result<f64, String> {
    let value = number(text)?;
    if (low..=high).contains(&value) {
        Ok(value)
    } else {
        Err(format!("expected {low} to {high}"))
    }
}
