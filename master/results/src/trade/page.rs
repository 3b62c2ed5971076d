//! The study as one HTML page, which loads nothing and needs no script.

use std::io::Write;

use nestrad_common::options::Diameter;

use super::bars;
use super::choice::{Point, pareto};
use super::plot::{Mark, Plot, draw};
use super::table::{Comparison, Measured, Row};
use super::terminal::{HEADINGS, megabytes, range, short};
use crate::error::Fault;
use crate::html::{self, escaped};

const PAGE: &str = include_str!("page.html");

/// What the page says of a study besides its numbers.
#[derive(Clone, Copy, Debug)]
pub struct About<'a> {
    /// What was studied.
    pub title: &'a str,
    /// Runs of each setting.
    pub runs: u32,
    /// Threads of each run.
    pub threads: usize,
}

/// Writes the page.
pub(super) fn write(
    about: &About<'_>,
    comparison: &Comparison,
    out: &mut impl Write,
) -> Result<(), Fault> {
    html::fill(PAGE, out, |name, out| {
        let text = match name {
            "title" => escaped(about.title),
            "style" => html::STYLE.to_owned(),
            "facts" => facts(about),
            "choices" => choices(comparison),
            "reference" => reference(comparison),
            "bands" => (0..comparison.bands.len())
                .map(|band| band_section(comparison, band))
                .collect(),
            "diameters" => diameters(comparison),
            "stages" => bars::draw(comparison),
            "settings" => settings(comparison),
            _ => failed(comparison),
        };
        Ok(out.write_all(text.as_bytes())?)
    })
}

fn facts(about: &About<'_>) -> String {
    let (version, runs, threads) = (env!("CARGO_PKG_VERSION"), about.runs, about.threads);
    format!(
        "nestrad {version}; {runs} seeds for each setting; {threads} threads. Times are of this machine."
    )
}

/// Rows of cells, which are HTML already.
fn table(headings: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let row = |tag: &str, cells: Vec<String>| {
        let cells: String = cells
            .iter()
            .map(|cell| format!("<{tag}>{cell}</{tag}>"))
            .collect();
        format!("<tr>{cells}</tr>\n")
    };
    let head = row("th", headings.iter().map(|h| escaped(h)).collect());
    let rows: String = rows.map(|cells| row("td", cells)).collect();
    format!("<table>\n{head}{rows}</table>\n")
}

fn choices(comparison: &Comparison) -> String {
    let rows = comparison.choices.iter().map(|choice| {
        let mut cells = match comparison.chosen(choice) {
            Ok(cells) => cells.map(|cell| escaped(&cell)).to_vec(),
            Err(missed) => {
                let target = format!("{} %", choice.target_percent);
                let why = format!("none: {}", escaped(&missed.to_string()));
                let empty = String::new;
                vec![target, why, empty(), empty(), empty()]
            }
        };
        let more = comparison.without_flags(choice);
        cells.push(escaped(&more.unwrap_or_default()));
        cells
    });
    table(&[&HEADINGS[..], &["remark"]].concat(), rows)
}

fn reference(comparison: &Comparison) -> String {
    let bands = comparison
        .bands
        .iter()
        .zip(&comparison.reference_error_percent);
    let own = bands.map(|(band, error)| format!("{} % in {}", short(*error), escaped(band)));
    format!(
        "The reference is the mean of runs whose stated error is {} %. By their scatter, the reference itself has an error of {}; the errors shown here do not include it.",
        short(comparison.reference_percent),
        own.collect::<Vec<_>>().join(", ")
    )
}

const KINDS: [&str; 3] = [
    "chosen by flags, D = inf",
    "finite D",
    "changed plan: no flags select it",
];

fn kind(row: &Row) -> usize {
    match row.setting.diameter {
        _ if row.flags.is_some() => 0,
        Diameter::Metres(_) if row.setting.is_within() => 1,
        _ => 2,
    }
}

fn mark(comparison: &Comparison, row: &Row, measured: &Measured, band: usize) -> Mark {
    let error = measured.errors[band];
    Mark {
        x: Some(measured.cpu_s),
        error,
        kind: kind(row),
        label: None,
        hint: format!(
            "{}: {} % in {}, {} s",
            row.setting,
            range(error),
            comparison.bands[band],
            short(measured.cpu_s)
        ),
    }
}

fn band_section(comparison: &Comparison, band: usize) -> String {
    let rows: Vec<_> = comparison.measured().collect();
    let points: Vec<Point> = rows
        .iter()
        .map(|(_, _, m)| Point {
            cpu_s: m.cpu_s,
            worst: m.errors[band],
        })
        .collect();
    let front = pareto(&points);
    let marks = rows.iter().zip(&front).map(|((number, row, m), &on)| Mark {
        label: on.then(|| (number + 1).to_string()),
        ..mark(comparison, row, m, band)
    });
    let marks: Vec<Mark> = marks.collect();
    let mut line: Vec<usize> = (0..rows.len()).filter(|&place| front[place]).collect();
    line.sort_by(|&a, &b| points[a].cpu_s.total_cmp(&points[b].cpu_s));
    let plot = draw(&Plot {
        x_title: "CPU time of a solve, s",
        kinds: KINDS.map(str::to_owned).to_vec(),
        marks,
        lines: vec![line],
    });
    format!(
        "<section>\n<h2>Error over cost: {}</h2>\n{plot}\
         <p>Each mark is a setting: its CPU time, and its error in this band; further left is faster, further \
         down is better. The broken line joins the Pareto front of this band, the settings for which no other is \
         both faster and more accurate; numbers are those of the table below. A bar that reaches the lower edge \
         means that the error may be zero.</p>\n</section>\n",
        escaped(&comparison.bands[band])
    )
}

/// The settings that differ in nothing but the diameter, if there are any.
fn diameters(comparison: &Comparison) -> String {
    let alike = || {
        comparison
            .measured()
            .filter(|(_, row, _)| row.setting.is_within())
    };
    let finite = alike().find(|(_, row, _)| row.setting.diameter != Diameter::Infinite);
    let Some((_, first, _)) = finite else {
        return "<section>\n<h2>Error over D</h2>\n<p>No finite diameter D of the sphere of near exchange was \
                measured: a canopy that stands alone has none.</p>\n</section>\n"
            .to_owned();
    };
    let accuracy = first.setting.accuracy_percent;
    let own = alike().filter(|(_, row, _)| row.setting.accuracy_percent == accuracy);
    let mut own: Vec<(Option<f64>, &Row, &Measured)> = own
        .map(|(_, row, m)| match row.setting.diameter {
            Diameter::Metres(metres) => (Some(metres), row, m),
            _ => (None, row, m),
        })
        .collect();
    let metres = |x: Option<f64>| x.unwrap_or(f64::INFINITY);
    own.sort_by(|a, b| metres(a.0).total_cmp(&metres(b.0)));
    let (mut marks, mut lines) = (Vec::new(), Vec::new());
    for band in 0..comparison.bands.len() {
        lines.push((marks.len()..marks.len() + own.len()).collect());
        marks.extend(own.iter().map(|&(x, row, measured)| Mark {
            x,
            kind: band,
            ..mark(comparison, row, measured, band)
        }));
    }
    let plot = draw(&Plot {
        x_title: "diameter D of the sphere of near exchange, m",
        kinds: comparison.bands.clone(),
        marks,
        lines,
    });
    format!(
        "<section>\n<h2>Error over D</h2>\n{plot}<p>All marks have the plan for {accuracy} %, and differ in D only: \
         within the sphere light is exchanged on the true geometry, beyond it a multilayer model replaces the geometry. \
         With D = inf (at the right) there is no model; the height of a mark above that one is about the error \
         of the model.</p>\n</section>\n"
    )
}

fn settings(comparison: &Comparison) -> String {
    let errors: Vec<String> = comparison
        .bands
        .iter()
        .map(|band| format!("error in {band}, %"))
        .collect();
    let mut headings = vec!["number and setting"];
    headings.extend(errors.iter().map(String::as_str));
    headings.extend(["CPU time, s", "elapsed time, s", "memory", "rows", "front"]);
    let rows = comparison.measured().map(|(number, row, m)| {
        let mut cells = vec![escaped(&format!("{}: {}", number + 1, row.setting))];
        cells.extend(m.errors.iter().map(|&error| range(error)));
        cells.extend([
            short(m.cpu_s),
            short(m.wall_s),
            megabytes(m.peak_memory_bytes),
            megabytes(Some(m.row_bytes)),
            if m.on_front { "yes" } else { "" }.to_owned(),
        ]);
        cells
    });
    table(&headings, rows)
}

fn failed(comparison: &Comparison) -> String {
    let item = |(row, why): (&Row, &str)| {
        let setting = row.setting.to_string();
        format!("<li>{}: {}</li>\n", escaped(&setting), escaped(why))
    };
    let items: String = comparison.failed().map(item).collect();
    let items = if items.is_empty() {
        "<p>None.</p>\n".to_owned()
    } else {
        format!("<ul>\n{items}</ul>\n")
    };
    format!("<section>\n<h2>Settings that failed</h2>\n{items}</section>\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trade::table::tests::example;

    fn page() -> String {
        let about = About {
            title: "<i>field</i>.can",
            runs: 3,
            threads: 2,
        };
        let mut out = Vec::new();
        write(&about, &example(), &mut out).expect("written");
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn names_are_escaped_and_nothing_is_loaded() {
        let text = page();
        for tag in ["<i>", "<b>", "<out", "<script", "NaN", "{{"] {
            assert!(!text.contains(tag), "{tag}");
        }
        for outside in ["http:", "https:", "src=", "@import", "url("] {
            assert!(!text.contains(outside), "{outside}");
        }
        assert!(text.contains("&lt;b&gt;PAR&lt;/b&gt;") && text.contains("&lt;out of luck&gt;"));
    }

    #[test]
    fn the_page_has_its_plots_and_says_what_its_numbers_leave_out() {
        let text = page();
        // two bands, diameters, stages
        assert_eq!(text.matches("<svg").count(), 4);
        assert_eq!(text.matches("<svg").count(), text.matches("</svg>").count());
        for said in [
            "--accuracy 0.5 --diameter inf",
            "all of its\nrounds",
            "is not in the error bar",
            "computed by itself",
            ">inf</text>",
            "color-scheme: light dark",
        ] {
            assert!(text.contains(said), "{said}");
        }
    }
}
