//! Errors with their bars over a cost or a length, as SVG that stands in a page.

use std::fmt::Write;

use super::axis::LogAxis;
use super::measure::ErrorRange;
use crate::html::escaped;

/// Marks on two logarithmic axes.
#[derive(Clone, Debug)]
pub(super) struct Plot {
    /// What runs along the horizontal axis, with its unit.
    pub(super) x_title: &'static str,
    /// Kinds of marks: each has a colour and a shape.
    pub(super) kinds: Vec<String>,
    pub(super) marks: Vec<Mark>,
    /// Numbers of marks that a line goes through.
    pub(super) lines: Vec<Vec<usize>>,
}

/// An error, percent, with its ends.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    /// `None` is infinity, which has a place of its own at the right.
    pub(super) x: Option<f64>,
    pub(super) error: ErrorRange,
    pub(super) kind: usize,
    /// Written beside it.
    pub(super) label: Option<String>,
    /// Shown where the pointer rests on it.
    pub(super) hint: String,
}

/// Colours that the page has classes for, `c0` and on.
pub(super) const COLOURS: usize = 8;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 740.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 356.0;
/// Space that infinity takes.
const INFINITY: f64 = 70.0;

/// Draws a plot and, below it, its kinds of marks.
pub(super) fn draw(plot: &Plot) -> String {
    let unbounded = plot.marks.iter().any(|mark| mark.x.is_none());
    let right = if unbounded { RIGHT - INFINITY } else { RIGHT };
    let costs = plot.marks.iter().filter_map(|mark| mark.x);
    let x_axis = LogAxis::around(costs, [LEFT, right]);
    let errors = plot.marks.iter();
    let errors = errors.flat_map(|mark| [mark.error.percent, mark.error.high_percent]);
    let y_axis = LogAxis::around(errors, [BOTTOM, TOP]);
    let x = |mark: &Mark| mark.x.map_or(RIGHT - 0.3 * INFINITY, |x| x_axis.place(x));

    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"error over {}\">\n",
        plot.x_title
    );
    let infinity = unbounded.then(|| (RIGHT - 0.3 * INFINITY, "inf".to_owned()));
    let verticals = x_axis
        .ticks()
        .into_iter()
        .map(|(v, label)| (x_axis.place(v), label));
    for (at, label) in verticals.chain(infinity) {
        put(
            &mut svg,
            format_args!(
                "<path class=\"axis\" d=\"M{at:.1} {TOP}V{BOTTOM}\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>",
                BOTTOM + 16.0
            ),
        );
    }
    for (value, label) in y_axis.ticks() {
        let at = y_axis.place(value);
        put(
            &mut svg,
            format_args!(
                "<path class=\"axis\" d=\"M{LEFT} {at:.1}H{RIGHT}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>",
                LEFT - 6.0,
                at + 4.0
            ),
        );
    }
    put(
        &mut svg,
        format_args!(
            "<path class=\"frame\" d=\"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>\
         <text x=\"8\" y=\"14\">error, %</text>",
            0.5 * (LEFT + RIGHT),
            HEIGHT - 8.0,
            plot.x_title
        ),
    );
    for line in &plot.lines {
        let mut path = String::new();
        for (n, mark) in line.iter().map(|&n| &plot.marks[n]).enumerate() {
            let step = if n == 0 { 'M' } else { 'L' };
            let (x, y) = (x(mark), y_axis.place(mark.error.percent));
            let _ = write!(path, "{step}{x:.1} {y:.1}");
        }
        put(
            &mut svg,
            format_args!("<path class=\"joined\" d=\"{path}\"/>"),
        );
    }
    for mark in &plot.marks {
        let error = &mark.error;
        let [low, y, high] =
            [error.low_percent, error.percent, error.high_percent].map(|e| y_axis.place(e));
        draw_mark(&mut svg, mark, x(mark), [low, y, high]);
    }
    svg += "</svg>\n";
    svg + &legend(&plot.kinds)
}

fn draw_mark(svg: &mut String, mark: &Mark, x: f64, [low, y, high]: [f64; 3]) {
    let colour = mark.kind % COLOURS;
    let shape = match mark.kind % 3 {
        0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"/>"),
        1 => format!("<path d=\"M{:.1} {:.1}h7v7h-7z\"/>", x - 3.5, y - 3.5),
        _ => format!("<path d=\"M{x:.1} {:.1}l5 5l-5 5l-5 -5z\"/>", y - 5.0),
    };
    let [left, right] = [x - 3.0, x + 3.0];
    put(
        svg,
        format_args!(
            "<g class=\"mark c{colour}\"><title>{}</title>\
         <path class=\"bar\" d=\"M{x:.1} {low:.1}V{high:.1}M{left:.1} {low:.1}H{right:.1}M{left:.1} {high:.1}H{right:.1}\"/>{shape}</g>",
            escaped(&mark.hint)
        ),
    );
    if let Some(label) = &mark.label {
        put(
            svg,
            format_args!(
                "<text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                x + 7.0,
                y - 6.0,
                escaped(label)
            ),
        );
    }
}

/// What the colours mean.
pub(super) fn legend(kinds: &[String]) -> String {
    let entry = |(kind, name): (usize, &String)| {
        let (colour, name) = (kind % COLOURS, escaped(name));
        format!("<span class=\"swatch c{colour}\"></span>{name} ")
    };
    let entries: String = kinds.iter().enumerate().map(entry).collect();
    format!("<p class=\"hint\">{entries}</p>\n")
}

fn put(svg: &mut String, words: std::fmt::Arguments<'_>) {
    // a string takes all that it gets
    let _ = writeln!(svg, "{words}");
}
