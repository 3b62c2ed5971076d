//! Weather as CSV: a header, a column `time`, and irradiances.
//!
//! ```text
//! time,ghi_W_m2,dhi_W_m2
//! 2026-06-21T06:00+02:00,0,0
//! 2026-06-21T07:00+02:00,112.5,60
//! ```
//!
//! Columns are known by their names, in any order: `time`; `ghi`, `dhi`, `dni` with or without `_W_m2`, in any case; and
//! for a band of the name PAR `direct_PAR_W_m2` and `diffuse_PAR_W_m2`, both of the horizontal. Others are not used.
//! Lines that begin with `#` are comments.

use std::collections::BTreeMap;

use csv::{ByteRecord, ReaderBuilder, Trim};
use jiff::Timestamp;

use super::error::{FormatError, Place, excerpt};
use crate::bounded::with_line_feeds;
use crate::light::{AN_IRRADIANCE, is_irradiance};

/// A weather file, each row of which is well formed and later than the one before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weather {
    /// The file, in messages.
    pub file: String,
    /// At least two.
    pub rows: Vec<WeatherRow>,
    /// Names of columns that are not used.
    pub unused: Vec<String>,
}

/// What a row says. What it says of the sky is not checked against the sun.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WeatherRow {
    /// Line of the file, counted from 1.
    pub line: usize,
    /// As written.
    pub time: String,
    /// The same.
    pub moment: Timestamp,
    /// Global irradiance of the horizontal, W m⁻².
    pub ghi_W_m2: Option<f64>,
    /// Diffuse irradiance of the horizontal, W m⁻².
    pub dhi_W_m2: Option<f64>,
    /// Direct irradiance across the beam, W m⁻².
    pub dni_W_m2: Option<f64>,
    /// Irradiances of the horizontal by the name of a band.
    pub bands: BTreeMap<String, BandIrradiance>,
}

/// Irradiance of the horizontal in a band, W m⁻².
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BandIrradiance {
    /// Straight from the sun.
    pub direct_W_m2: f64,
    /// From the sky.
    pub diffuse_W_m2: f64,
}

/// Most columns that are looked at.
const MOST_COLUMNS: usize = 4096;

/// Parses a weather file; `file` is its name in messages.
pub fn parse(file: &str, bytes: &[u8]) -> Result<Weather, FormatError> {
    let bytes = with_line_feeds(bytes);
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .trim(Trim::All)
        .comment(Some(b'#'))
        .from_reader(text);
    let mut record = ByteRecord::new();
    let mut lines = LineCount {
        text,
        at: 0,
        line: 1,
    };
    let mut header: Option<Header> = None;
    let mut rows: Vec<WeatherRow> = Vec::new();
    loop {
        let read = reader.read_byte_record(&mut record);
        let more = read.map_err(|error| FormatError::Content {
            place: Place::file(file),
            expected: "comma-separated text".to_owned(),
            found: error.to_string(),
        })?;
        if !more {
            break;
        }
        let start = record.position().map_or(0, csv::Position::byte);
        let line = lines.line_at(usize::try_from(start).unwrap_or(usize::MAX));
        let at = At { file, line };
        let Some(header) = &header else {
            header = Some(Header::of(&record, at)?);
            continue;
        };
        let row = header.row(&record, at)?;
        if let Some(before) = rows.last().filter(|before| before.moment >= row.moment) {
            let expected = format!(
                "a time after that of line {} ({})",
                before.line, before.time
            );
            let found = match before.moment == row.moment {
                true => format!("the same moment, {}", row.time),
                false => row.time,
            };
            return Err(at.fault(expected, found));
        }
        rows.push(row);
    }
    let found = rows.len();
    if found < 2 {
        return Err(FormatError::Content {
            place: Place::file(file),
            expected: "a header and at least two rows".to_owned(),
            found: match (&header, found) {
                (None, _) => "nothing".to_owned(),
                (Some(_), found) => format!("{found} rows"),
            },
        });
    }
    Ok(Weather {
        file: file.to_owned(),
        rows,
        unused: header.map(|header| header.unused).unwrap_or_default(),
    })
}

/// Counts lines as they are read: the reader's own count stands before the comments and ends of lines that it skips.
struct LineCount<'a> {
    text: &'a [u8],
    at: usize,
    line: usize,
}

impl LineCount<'_> {
    /// The line of the record that the reader says begins here, or after what it skips.
    fn line_at(&mut self, start: usize) -> usize {
        let mut is_comment = false;
        while let Some(&byte) = self.text.get(self.at) {
            let is_end = byte == b'\n' || byte == b'\r';
            if self.at >= start {
                is_comment = !is_end && (is_comment || byte == b'#');
                if !is_end && !is_comment {
                    break;
                }
            }
            self.line += usize::from(byte == b'\n');
            self.at += 1;
        }
        self.line
    }
}

/// A line of a file.
#[derive(Clone, Copy)]
struct At<'a> {
    file: &'a str,
    line: usize,
}

impl At<'_> {
    fn fault(self, expected: impl Into<String>, found: impl Into<String>) -> FormatError {
        FormatError::Content {
            place: Place::line(self.file, self.line),
            expected: expected.into(),
            found: found.into(),
        }
    }
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Broadband {
    Global,
    Diffuse,
    Direct,
}

/// Where columns stand.
#[derive(Debug, Default)]
struct Header {
    columns: usize,
    time: usize,
    broadband: Vec<(Broadband, usize, String)>,
    /// By name: direct and diffuse.
    bands: Vec<(String, [usize; 2])>,
    unused: Vec<String>,
}

impl Header {
    fn of(record: &ByteRecord, at: At<'_>) -> Result<Self, FormatError> {
        if record.len() > MOST_COLUMNS {
            let found = format!("{} columns", record.len());
            return Err(at.fault("at most 4096 columns", found));
        }
        let mut header = Self {
            columns: record.len(),
            ..Self::default()
        };
        let mut time = None;
        let mut halves: BTreeMap<String, [Option<usize>; 2]> = BTreeMap::new();
        for (number, name) in record.iter().enumerate() {
            let Ok(name) = std::str::from_utf8(name) else {
                return Err(at.fault("names of columns as UTF-8 text", excerpt(name)));
            };
            let twice = || at.fault(format!("one column {name}"), "two");
            let lower = name.to_ascii_lowercase();
            let broadband = match lower.strip_suffix("_w_m2").unwrap_or(&lower) {
                "ghi" => Some(Broadband::Global),
                "dhi" => Some(Broadband::Diffuse),
                "dni" => Some(Broadband::Direct),
                _ => None,
            };
            if lower == "time" {
                if time.replace(number).is_some() {
                    return Err(twice());
                }
            } else if let Some(what) = broadband {
                if header.broadband.iter().any(|(known, ..)| *known == what) {
                    return Err(twice());
                }
                header.broadband.push((what, number, name.to_owned()));
            } else if let Some((half, band)) = of_band(name) {
                let place = &mut halves.entry(band.to_owned()).or_default()[half];
                if place.replace(number).is_some() {
                    return Err(twice());
                }
            } else {
                header.unused.push(name.to_owned());
            }
        }
        let Some(time) = time else {
            return Err(at.fault("a header with a column time", shown(record)));
        };
        header.time = time;
        for (band, halves) in halves {
            let [Some(direct), Some(diffuse)] = halves else {
                let expected =
                    format!("columns direct_{band}_W_m2 and diffuse_{band}_W_m2, both of them");
                return Err(at.fault(expected, "one of them"));
            };
            header.bands.push((band, [direct, diffuse]));
        }
        if header.bands.is_empty() && header.broadband.len() < 2 {
            let expected = "two of ghi_W_m2, dhi_W_m2 and dni_W_m2, or direct_BAND_W_m2 and diffuse_BAND_W_m2 of bands";
            return Err(at.fault(expected, shown(record)));
        }
        Ok(header)
    }

    fn row(&self, record: &ByteRecord, at: At<'_>) -> Result<WeatherRow, FormatError> {
        if record.len() != self.columns {
            let expected = format!("{} values, as the header has", self.columns);
            return Err(at.fault(expected, record.len().to_string()));
        }
        let cell = |column: usize| record.get(column).unwrap_or_default();
        let given = cell(self.time);
        let time = std::str::from_utf8(given).ok();
        let moment = time.and_then(|time| time.parse::<Timestamp>().ok());
        let (Some(time), Some(moment)) = (time, moment) else {
            let expected = "a time with its offset from UTC, such as 2026-06-21T12:00:00+02:00";
            return Err(at.fault(expected, excerpt(given)));
        };
        let mut row = WeatherRow {
            line: at.line,
            time: time.to_owned(),
            moment,
            ..WeatherRow::default()
        };
        let number = |column: usize, name: &str| {
            let given = cell(column);
            let value = std::str::from_utf8(given).ok();
            let value = value.and_then(|text| text.parse::<f64>().ok());
            // adding zero turns -0 into 0
            let value = value.filter(|value| is_irradiance(*value));
            value.map(|value| value + 0.0).ok_or_else(|| {
                let found = match given {
                    b"" => "nothing".to_owned(),
                    given => excerpt(given),
                };
                at.fault(format!("an irradiance of {AN_IRRADIANCE} in {name}"), found)
            })
        };
        for (what, column, name) in &self.broadband {
            let value = Some(number(*column, name)?);
            match what {
                Broadband::Global => row.ghi_W_m2 = value,
                Broadband::Diffuse => row.dhi_W_m2 = value,
                Broadband::Direct => row.dni_W_m2 = value,
            }
        }
        for (band, [direct, diffuse]) in &self.bands {
            let irradiance = BandIrradiance {
                direct_W_m2: number(*direct, &format!("direct_{band}_W_m2"))?,
                diffuse_W_m2: number(*diffuse, &format!("diffuse_{band}_W_m2"))?,
            };
            row.bands.insert(band.clone(), irradiance);
        }
        Ok(row)
    }
}

/// The band of a column's name, and whether it is the direct (0) or the diffuse (1) half.
fn of_band(name: &str) -> Option<(usize, &str)> {
    let halves = ["direct_", "diffuse_"].into_iter().enumerate();
    let mut found = halves.filter_map(|(half, begin)| {
        let start = name.get(..begin.len())?;
        let rest = name.get(begin.len()..)?;
        let end = rest.len().checked_sub("_W_m2".len())?;
        let is_named =
            start.eq_ignore_ascii_case(begin) && rest.get(end..)?.eq_ignore_ascii_case("_W_m2");
        let band = rest.get(..end)?;
        (is_named && !band.is_empty()).then_some((half, band))
    });
    found.next()
}

fn shown(record: &ByteRecord) -> String {
    excerpt(record.iter().collect::<Vec<_>>().join(&b","[..]).as_slice())
}

#[cfg(test)]
#[path = "weather_tests.rs"]
mod tests;
