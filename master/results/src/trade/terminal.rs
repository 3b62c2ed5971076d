//! The choice as a table on the terminal, and numbers as people read them.

use std::io::{self, Write};

use nestrad_common::figures::fixed;

use super::choice::Missed;
use super::measure::ErrorRange;
use super::table::{Choice, Comparison, Measured};

/// Headings of the table of choices, here and on the page.
pub(super) const HEADINGS: [&str; 5] = [
    "target error",
    "flags of nestrad solve",
    "error of the worst band",
    "CPU time",
    "peak memory",
];

impl Comparison {
    /// Writes what to take for each error.
    pub fn write_choices(&self, out: &mut impl Write) -> io::Result<()> {
        let mut rows = vec![HEADINGS.map(str::to_owned)];
        rows.extend(self.choices.iter().filter_map(|c| self.chosen(c).ok()));
        let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
        let widths = [0, 1, 2, 3, 4].map(|column| width(column).unwrap_or(0));
        for row in &rows {
            let cells = row
                .iter()
                .zip(widths)
                .map(|(c, width)| format!("{c:width$}"));
            writeln!(out, "{}", cells.collect::<Vec<_>>().join("  ").trim_end())?;
        }
        for choice in &self.choices {
            let target = choice.target_percent;
            if let Err(missed) = &choice.chosen {
                writeln!(out, "{target} %: {missed}")?;
            }
            if let Some(line) = self.without_flags(choice) {
                writeln!(out, "{target} %: {line}")?;
            }
        }
        Ok(())
    }

    /// Cells of a choice, under the headings, or why there is none.
    pub(super) fn chosen(&self, choice: &Choice) -> Result<[String; 5], Missed> {
        let row = &self.rows[choice.chosen?];
        let measured = row.outcome.as_ref().map_err(|_| Missed::NothingMeasured)?;
        Ok([
            format!("{} %", choice.target_percent),
            row.flags.clone().unwrap_or_default(),
            self.worst(measured),
            format!("{} s", short(measured.cpu_s)),
            megabytes(measured.peak_memory_bytes),
        ])
    }

    /// Says that a setting is better which no flags ask for.
    pub(super) fn without_flags(&self, choice: &Choice) -> Option<String> {
        let row = &self.rows[choice.without_flags?];
        let measured = row.outcome.as_ref().ok()?;
        let (setting, seconds) = (&row.setting, short(measured.cpu_s));
        Some(format!(
            "{setting} would take {seconds} s, but no flags select it"
        ))
    }

    /// The error of the worst band, and its name.
    fn worst(&self, measured: &Measured) -> String {
        let (band, error) = (&self.bands[measured.worst], measured.errors[measured.worst]);
        format!("{} % in {band}", range(error))
    }
}

/// An error with its ends, percent.
pub(super) fn range(error: ErrorRange) -> String {
    let [value, low, high] = [error.percent, error.low_percent, error.high_percent].map(short);
    format!("{value} ({low} to {high})")
}

/// Bytes as megabytes.
pub(super) fn megabytes(bytes: Option<u64>) -> String {
    bytes.map_or_else(
        || "not known".to_owned(),
        |b| format!("{} MB", short(b as f64 / 1e6)),
    )
}

/// Three digits, no more than three decimals.
pub(super) fn short(value: f64) -> String {
    let decimals = match value.abs() {
        v if v < 1.0 => 3,
        v if v < 10.0 => 2,
        v if v < 100.0 => 1,
        _ => 0,
    };
    fixed(value, decimals)
}

#[cfg(test)]
mod tests {
    use crate::trade::table::tests::example;

    #[test]
    fn what_is_chosen_and_what_is_missed_is_said() {
        let mut out = Vec::new();
        example().write_choices(&mut out).expect("written");
        let text = String::from_utf8(out).expect("text");
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(
            lines[2],
            "0.5 %         --accuracy 0.5 --diameter inf  0.400 (0.320 to 0.480) % in N,IR  10.0 s    1.00 MB"
        );
        assert_eq!(
            lines[3],
            "0.5 %: 0.5 %, sets x 0.5 would take 7.00 s, but no flags select it"
        );
        assert!(
            lines[4].starts_with("0.2 %: the best setting has"),
            "{text}"
        );
        assert_eq!(lines.len(), 5, "{text}");
    }
}
