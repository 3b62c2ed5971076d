//! Curves as a drawing, for the documentation.

use std::fmt::Write;

/// A curve with its name.
pub struct Curve {
    /// Written at its right end.
    pub name: String,
    /// Places in the units of the axes, all above 0.
    pub points: Vec<(f64, f64)>,
}

/// A chart with two logarithmic axes.
pub struct Chart {
    /// Over the chart.
    pub title: String,
    /// What runs along the horizontal axis, and its ends.
    pub x: (String, f64, f64),
    /// What runs along the vertical axis, and its ends.
    pub y: (String, f64, f64),
    /// From dark to light.
    pub curves: Vec<Curve>,
}

const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 56.0;
const RIGHT: f64 = 88.0;
const ABOVE: f64 = 28.0;
const BELOW: f64 = 42.0;

/// Charts side by side as SVG.
pub fn svg(charts: &[Chart]) -> String {
    let width = WIDTH * charts.len() as f64;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {HEIGHT}\" \
         font-family=\"sans-serif\" font-size=\"10\">\n\
         <rect width=\"{width}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
    );
    for (k, chart) in charts.iter().enumerate() {
        let _ = writeln!(svg, "<g transform=\"translate({},0)\">", WIDTH * k as f64);
        draw(chart, &mut svg);
        svg += "</g>\n";
    }
    svg + "</svg>\n"
}

fn draw(chart: &Chart, svg: &mut String) {
    let part = |v: f64, lo: f64, hi: f64| (v / lo).ln() / (hi / lo).ln();
    let x = |v: f64| LEFT + (WIDTH - LEFT - RIGHT) * part(v, chart.x.1, chart.x.2);
    let y = |v: f64| HEIGHT - BELOW - (HEIGHT - ABOVE - BELOW) * part(v, chart.y.1, chart.y.2);
    let (left, right) = (LEFT, WIDTH - RIGHT);
    let (top, bottom) = (ABOVE, HEIGHT - BELOW);
    let mut text = |at: [f64; 2], anchor: &str, words: &str| {
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\">{words}</text>",
            at[0], at[1]
        );
    };
    text([left, 16.0], "start", &chart.title);
    text([0.5 * (left + right), HEIGHT - 10.0], "middle", &chart.x.0);
    text([left, top - 2.0], "end", &chart.y.0);
    for tick in decades(chart.x.1, chart.x.2) {
        text([x(tick), bottom + 14.0], "middle", &label(tick));
    }
    for tick in decades(chart.y.1, chart.y.2) {
        text([left - 6.0, y(tick) + 3.0], "end", &label(tick));
    }
    for curve in &chart.curves {
        if let Some(&(u, v)) = curve.points.last() {
            text([x(u) + 5.0, y(v) + 3.0], "start", &curve.name);
        }
    }
    let _ = writeln!(
        svg,
        "<path d=\"M{left} {top}V{bottom}H{right}\" fill=\"none\" stroke=\"black\"/>"
    );
    for (k, curve) in chart.curves.iter().enumerate() {
        let hue = 220.0 - 180.0 * k as f64 / chart.curves.len().max(2) as f64;
        let mut path = String::new();
        for (n, &(u, v)) in curve.points.iter().enumerate() {
            let step = if n == 0 { 'M' } else { 'L' };
            let _ = write!(path, "{step}{:.1} {:.1}", x(u), y(v));
        }
        let _ = writeln!(
            svg,
            "<path d=\"{path}\" fill=\"none\" stroke=\"hsl({hue:.0},70%,40%)\" stroke-width=\"1.5\"/>"
        );
    }
}

/// The powers of ten between two numbers, the ends included; every other one where there are many.
fn decades(lo: f64, hi: f64) -> Vec<f64> {
    let (first, last) = ((lo.log10() - 1e-9).ceil(), (hi.log10() + 1e-9).floor());
    let step = if last - first > 6.0 { 2 } else { 1 };
    (first as i32..=last as i32)
        .step_by(step)
        .map(|k| 10f64.powi(k))
        .collect()
}

fn label(tick: f64) -> String {
    if (0.1..1e4).contains(&tick) {
        format!("{tick}")
    } else {
        format!("{tick:e}")
    }
}
