//! The result as a compact table on the terminal.
//!
//! One line per band: what comes in and where it goes, each with its standard error, per m² of
//! ground where there is a pattern and for the whole scene where there is none. Columns of what a
//! scene does not have (structures, soil, a void below, scattered light that is not followed) are left out. Five significant digits of the light
//! that comes in are shown, or fewer where the table would not fit into 80 columns. A second table says what
//! each material absorbs, where there are several.

use std::fmt::Write as _;
use std::io::{self, Write};

use nestrad_common::canopy::{Canopy, Kind};
use nestrad_common::figures::fixed;
use nestrad_engine::account::organ_spread;
use nestrad_engine::solution::{Balance, Estimate, Solution};
use nestrad_engine::stopwatch::Usage;

const COLUMNS: usize = 80;

/// For the name of a material.
const NAME_COLUMNS: usize = 24;

/// More materials than this are not listed.
const MOST_MATERIALS: usize = 12;

/// Writes the energy balance of all bands, the standard error of organs, and what it cost.
pub fn write(
    out: &mut impl Write,
    canopy: &Canopy,
    solution: &Solution,
    usage: Usage,
) -> io::Result<()> {
    write_balance(out, canopy, &solution.balance)?;
    write_organ_errors(out, canopy, solution)?;
    write_usage(out, usage)
}

/// A column of the table: heading, and what stands in it.
type Flow = (&'static str, fn(&Balance) -> Estimate);

fn flows(balance: &[Balance]) -> Vec<Flow> {
    let always: [Flow; 2] = [
        ("plants", |b| b.absorbed_plants_W),
        ("escaped up", |b| b.escaped_up_W),
    ];
    let only_where_there_is_some: [Flow; 4] = [
        ("structures", |b| b.absorbed_structures_W),
        ("soil", |b| b.absorbed_soil_W),
        ("escaped down", |b| b.escaped_down_W),
        ("scattered", |b| b.scattered_W),
    ];
    let [plants, escaped_up] = always;
    let mut flows = vec![plants];
    flows.extend(
        only_where_there_is_some
            .into_iter()
            .filter(|(_, flow)| balance.iter().any(|b| matters(flow(b), b.incoming_W))),
    );
    flows.extend([escaped_up, ("closure", |b: &Balance| b.closure_W)]);
    flows
}

/// More than five digits of the light that comes in could show.
fn matters(flow: Estimate, incoming_W: f64) -> bool {
    flow.value.abs().max(flow.se) > 1e-5 * incoming_W
}

fn write_balance(out: &mut impl Write, canopy: &Canopy, balance: &[Balance]) -> io::Result<()> {
    let area_m2 = canopy.pattern.map_or(1.0, |pattern| pattern.area_m2());
    let largest = balance
        .iter()
        .fold(0.0, |max, b| f64::max(max, b.incoming_W))
        / area_m2;
    let unit = Unit::fitting(largest);
    let per = if canopy.pattern.is_some() {
        "W per m² of ground"
    } else {
        "W, whole scene"
    };
    writeln!(out, "light in {}{per} (± one standard error)", unit.prefix)?;

    let (decimals, divisor) = (unit.decimals(largest), unit.scale * area_m2);
    write_table(out, decimals, |decimals| rows(balance, divisor, decimals))?;
    let materials = balance.first().map_or(0, |band| band.materials.len());
    if materials < 2 {
        return Ok(());
    }
    if materials > MOST_MATERIALS {
        let place = "energy_balance in summary.json";
        return writeln!(out, "absorbed by each of {materials} materials: {place}");
    }
    write_table(out, decimals, |decimals| {
        of_materials(balance, divisor, decimals)
    })
}

/// As many decimals as fit into the columns there are.
fn write_table(
    out: &mut impl Write,
    mut decimals: usize,
    rows: impl Fn(usize) -> Vec<Vec<String>>,
) -> io::Result<()> {
    loop {
        let rows = rows(decimals);
        let widths = widths(&rows);
        let total = widths.iter().sum::<usize>() + 2 * (widths.len() - 1);
        if total <= COLUMNS || decimals == 0 {
            return rows.iter().try_for_each(|row| write_row(out, row, &widths));
        }
        decimals -= 1;
    }
}

/// All cells as text, the heading first.
fn rows(balance: &[Balance], divisor: f64, decimals: usize) -> Vec<Vec<String>> {
    let flows = flows(balance);
    let heading = ["band", "incoming"]
        .into_iter()
        .chain(flows.iter().map(|(name, _)| *name));
    let mut rows = vec![heading.map(str::to_owned).collect::<Vec<_>>()];
    for band in balance {
        let mut row = vec![
            shortened(&band.band),
            fixed(band.incoming_W / divisor, decimals),
        ];
        let cell = |(_, flow): &Flow| with_error(flow(band), divisor, decimals);
        row.extend(flows.iter().map(cell));
        rows.push(row);
    }
    rows
}

/// What each material absorbs, those of a kind together; the heading first.
fn of_materials(balance: &[Balance], divisor: f64, decimals: usize) -> Vec<Vec<String>> {
    let mut heading = vec!["absorbed by".to_owned(), "kind".to_owned()];
    heading.extend(balance.iter().map(|band| shortened(&band.band)));
    let mut rows = vec![heading];
    let Some(first) = balance.first() else {
        return rows;
    };
    for kind in Kind::ALL {
        for (m, material) in first.materials.iter().enumerate() {
            if material.kind != kind {
                continue;
            }
            let mut row = vec![shortened_to(&material.name, NAME_COLUMNS), kind.to_string()];
            let of_band = balance.iter().filter_map(|band| band.materials.get(m));
            row.extend(of_band.map(|of| with_error(of.absorbed_W, divisor, decimals)));
            rows.push(row);
        }
    }
    rows
}

fn with_error(Estimate { value, se }: Estimate, divisor: f64, decimals: usize) -> String {
    let [value, se] = [value, se].map(|x| fixed(x / divisor, decimals));
    format!("{value} ±{se}")
}

fn widths(rows: &[Vec<String>]) -> Vec<usize> {
    let columns = rows.first().map_or(0, Vec::len);
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
    (0..columns)
        .map(|column| width(column).unwrap_or(0))
        .collect()
}

/// Names to the left, numbers to the right.
fn write_row(out: &mut impl Write, row: &[String], widths: &[usize]) -> io::Result<()> {
    for (column, (cell, &width)) in row.iter().zip(widths).enumerate() {
        match column {
            0 => write!(out, "{cell:width$}")?,
            _ => write!(out, "  {cell:>width$}")?,
        }
    }
    writeln!(out)
}

/// A band's name in twelve columns at most.
fn shortened(name: &str) -> String {
    shortened_to(name, 12)
}

fn shortened_to(name: &str, columns: usize) -> String {
    if name.chars().count() <= columns {
        return name.to_owned();
    }
    name.chars().take(columns - 1).chain(['…']).collect()
}

/// A decimal multiple of the watt.
struct Unit {
    prefix: &'static str,
    scale: f64,
}

impl Unit {
    /// The unit in which `largest` has one to four digits before the point.
    fn fitting(largest: f64) -> Self {
        let (prefix, scale) = match largest {
            w if w >= 1e7 => ("M", 1e6),
            w if w >= 1e4 => ("k", 1e3),
            w if w >= 1.0 || w == 0.0 => ("", 1.0),
            w if w >= 1e-3 => ("m", 1e-3),
            w if w >= 1e-6 => ("µ", 1e-6),
            _ => ("n", 1e-9),
        };
        Self { prefix, scale }
    }

    /// Decimals that make five significant digits of `largest`.
    fn decimals(&self, largest: f64) -> usize {
        match largest / self.scale {
            w if w >= 1e4 => 0,
            w if w >= 1e3 => 1,
            w if w >= 1e2 => 2,
            w if w >= 1e1 => 3,
            _ => 4,
        }
    }
}

fn write_organ_errors(
    out: &mut impl Write,
    canopy: &Canopy,
    solution: &Solution,
) -> io::Result<()> {
    let mut line = String::from("standard error of organs, rms, in percent of the mean:");
    for spread in organ_spread(&canopy.plants(), solution) {
        let Some(percent) = spread.rms_percent else {
            continue;
        };
        let entry = format!(" {} {percent:.2} %;", shortened(&spread.band));
        if line.chars().count() + entry.chars().count() > COLUMNS {
            writeln!(out, "{line}")?;
            line = String::from(" ");
        }
        line.push_str(&entry);
    }
    match line.strip_suffix(';') {
        Some(line) => writeln!(out, "{line}"),
        None => Ok(()),
    }
}

fn write_usage(out: &mut impl Write, usage: Usage) -> io::Result<()> {
    let mut line = format!(
        "{:.2} s elapsed, {:.2} s of CPU time",
        usage.wall_s, usage.cpu_s
    );
    if let Some(bytes) = usage.peak_memory_bytes {
        let mebibytes = bytes.div_ceil(1 << 20);
        // writing to a String does not fail
        let _ = write!(line, ", at most {mebibytes} MiB of memory");
    }
    writeln!(out, "{line}")
}

#[cfg(test)]
#[path = "terminal_tests.rs"]
mod tests;
