//! Where the time goes: a bar for each setting, of its stages, as SVG that stands in a page.

use std::fmt::Write;

use super::plot::{COLOURS, legend};
use super::table::Comparison;
use super::terminal::short;
use crate::html::escaped;

const WIDTH: f64 = 760.0;
const LEFT: f64 = 210.0;
const RIGHT: f64 = 680.0;
const ROW: f64 = 20.0;
/// Percent of the time that have a tick.
const TICKS: [u8; 5] = [0, 25, 50, 75, 100];

/// Draws the parts of the processor time of all settings that were measured.
pub(super) fn draw(comparison: &Comparison) -> String {
    let mut names: Vec<String> = Vec::new();
    for name in comparison.measured().flat_map(|(_, _, m)| &m.stages) {
        if !names.contains(&name.0) {
            names.push(name.0.clone());
        }
    }
    let bottom = ROW * comparison.measured().count() as f64 + 4.0;
    let height = bottom + 40.0;
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"CPU time by stage\">\n"
    );
    for tick in TICKS {
        let x = LEFT + 0.01 * f64::from(tick) * (RIGHT - LEFT);
        let y = bottom + 15.0;
        let _ = writeln!(
            svg,
            "<path class=\"axis\" d=\"M{x} 0V{bottom}\"/><text x=\"{x}\" y=\"{y}\" text-anchor=\"middle\">{tick}</text>"
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">part of the CPU time, %</text>",
        0.5 * (LEFT + RIGHT),
        bottom + 33.0
    );
    for (row, (number, own, measured)) in comparison.measured().enumerate() {
        let y = ROW * row as f64 + 3.0;
        let total_s: f64 = measured.stages.iter().map(|(_, cpu_s)| cpu_s).sum();
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">{}</text>",
            LEFT - 6.0,
            y + 11.0,
            escaped(&format!("{}: {}", number + 1, own.setting))
        );
        let mut x = LEFT;
        for (stage, cpu_s) in &measured.stages {
            let part = if total_s > 0.0 { cpu_s / total_s } else { 0.0 };
            let colour = names.iter().position(|name| name == stage).unwrap_or(0) % COLOURS;
            let width = part * (RIGHT - LEFT);
            let hint = escaped(&format!("{stage}: {} s", short(*cpu_s)));
            let _ = writeln!(
                svg,
                "<rect class=\"c{colour}\" x=\"{x:.1}\" y=\"{y}\" width=\"{width:.1}\" height=\"14\"><title>{hint}</title></rect>"
            );
            x += width;
        }
        let (x, y) = (RIGHT + 6.0, y + 11.0);
        let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y}\">{} s</text>", short(total_s));
    }
    svg += "</svg>\n";
    svg + &legend(&names)
}
