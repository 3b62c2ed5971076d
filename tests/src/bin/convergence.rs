//! Measures the solver and the far field under stress: passes, errors and closures by how much leaves scatter
//! and how many there are. Writes the figures and the curves beside `master/docs/convergence.md`.

#![allow(clippy::print_stderr, reason = "a command that says how far it is")]

use std::fmt::Write;
use std::{fs, io};

use nestrad_common::generate::LeafAngles;
use nestrad_common::optics::LeafOptics;
use nestrad_common::options::Diameter;
use nestrad_common::scene::Scene;
use nestrad_engine::plan::Settings;
use nestrad_tests::canopies::{scenery, small_leaves, uniform_sky};
use nestrad_tests::chart::{Chart, Curve, svg};
use nestrad_tests::solving::{Solved, finish, try_plan};

const SCATTERED: [f64; 6] = [0.5, 0.9, 0.99, 0.999, 0.999_999, 1.0];
const LEAF_AREA_INDEX: [f64; 7] = [0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
const SOIL: [f64; 2] = [0.0, 1.0];
const TOLERANCES: [f64; 8] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];

/// Three hundred leaves, however large: of spherical angles in a layer of 3 m on 1 m².
fn canopy(lai: f64, scattered: f64, soil: f64) -> Scene {
    let leaves = small_leaves(lai, LeafAngles::Spherical, lai / 300.0, 5);
    let leaf = LeafOptics::symmetric(0.5 * scattered, 0.5 * scattered);
    scenery(&leaves, &[(leaf, soil)], uniform_sky(12, 1)).scene()
}

fn solved(
    scene: &Scene,
    diameter: Diameter,
    tolerance: f64,
) -> Result<Solved, Box<dyn std::error::Error>> {
    let settings = Settings {
        diameter,
        accuracy_percent: 5.0,
        ..Settings::default()
    };
    let mut plan = try_plan(scene, &settings)?;
    // leaves are not cut: it is the solver that is looked at
    plan.trace.max_edge_m = 1.0;
    plan.light.tolerance.absorbed = tolerance;
    Ok(finish(scene, &plan)?)
}

/// How far the organs' absorbed powers are from others, all together, relative to what comes in.
fn apart(a: &Solved, b: &Solved) -> f64 {
    let pairs = a.solution.organs.iter().zip(&b.solution.organs);
    let sum: f64 = pairs
        .map(|(a, b)| (a.absorbed_W - b.absorbed_W).abs())
        .sum();
    let [a, b] = [a, b].map(|s| &s.solution.balance[0]);
    (sum + (a.absorbed_soil_W.value - b.absorbed_soil_W.value).abs()
        + (a.escaped_up_W.value - b.escaped_up_W.value).abs())
        / b.incoming_W
}

fn passes(diameter: Diameter, csv: &mut String) -> Result<Vec<Chart>, Box<dyn std::error::Error>> {
    let mut charts = Vec::new();
    for soil in SOIL {
        let mut curves = Vec::new();
        for scattered in SCATTERED {
            let mut points = Vec::new();
            for lai in LEAF_AREA_INDEX {
                let found = solved(&canopy(lai, scattered, soil), diameter, 1e-6)?;
                let (n, balance) = (found.work.passes, &found.solution.balance[0]);
                let [closure, se] =
                    [balance.closure_W.value, balance.closure_W.se].map(|w| w / balance.incoming_W);
                let albedo = balance.escaped_up_W.value / balance.incoming_W;
                let line = format!(
                    "{diameter},{soil},{scattered},{lai},{n},{albedo:.8},{closure:.3e},{se:.3e}"
                );
                eprintln!("{line}");
                let _ = writeln!(csv, "{line}");
                points.push((lai, f64::from(n)));
            }
            let name = format!("{scattered}");
            curves.push(Curve { name, points });
        }
        let ground = if soil == 0.0 { "black" } else { "white" };
        charts.push(Chart {
            title: format!("D = {diameter}, {ground} soil; curves: rho + tau"),
            x: ("leaf area index".to_owned(), 0.5, 50.0),
            y: ("passes".to_owned(), 1.0, 200.0),
            curves,
        });
    }
    Ok(charts)
}

/// Asked for and true: against a solve to 1e-12.
fn errors(csv: &mut String) -> Result<Vec<Chart>, Box<dyn std::error::Error>> {
    let mut charts = Vec::new();
    for lai in [2.0, 20.0] {
        let mut curves = Vec::new();
        for scattered in [0.9, 0.999_999, 1.0] {
            let scene = canopy(lai, scattered, 0.5);
            let exact = solved(&scene, Diameter::Infinite, 1e-12)?;
            let mut points = Vec::new();
            for tolerance in TOLERANCES {
                let found = solved(&scene, Diameter::Infinite, tolerance)?;
                let off = apart(&found, &exact);
                let n = found.work.passes;
                let line = format!("{lai},{scattered},{tolerance:e},{n},{off:.3e}");
                eprintln!("{line}");
                let _ = writeln!(csv, "{line}");
                points.push((tolerance, off.max(1e-13)));
            }
            points.reverse();
            let name = format!("{scattered}");
            curves.push(Curve { name, points });
        }
        charts.push(Chart {
            title: format!("leaf area index {lai}, soil 0.5; curves: rho + tau"),
            x: ("tolerance".to_owned(), 1e-8, 1e-1),
            y: ("true error".to_owned(), 1e-12, 1.0),
            curves,
        });
    }
    Ok(charts)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut csv =
        "diameter_m,soil_albedo,rho_plus_tau,leaf_area_index,passes,albedo,closure,closure_se\n"
            .to_owned();
    let mut all = passes(Diameter::Infinite, &mut csv)?;
    save("convergence_full.svg", &svg(&all))?;
    all = passes(Diameter::Metres(1.0), &mut csv)?;
    save("convergence_sphere.svg", &svg(&all))?;
    save("convergence_passes.csv", &csv)?;
    csv = "leaf_area_index,rho_plus_tau,tolerance,passes,true_error\n".to_owned();
    all = errors(&mut csv)?;
    save("convergence_error.svg", &svg(&all))?;
    save("convergence_error.csv", &csv)?;
    Ok(())
}

fn save(name: &str, text: &str) -> io::Result<()> {
    let figures = concat!(env!("CARGO_MANIFEST_DIR"), "/../master/docs/figures");
    fs::write(format!("{figures}/{name}"), text)
}
