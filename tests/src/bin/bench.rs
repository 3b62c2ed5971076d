//! What a solve costs, stage by stage: real processes, one thread, several runs in turn.
//!
//! `cargo build --release && cargo run --release -p nestrad-tests --bin bench [RUNS]` prints a table of
//! medians, in Markdown, and every single figure below it. The scenes are a generated field of maize, one of
//! four times as many plants on four times the ground, and, where they are, the sample scenes.

#![allow(non_snake_case, reason = "units in names are written as units")]
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a command for developers: its table is its purpose, and any failure is the end of it"
)]

use std::path::{Path, PathBuf};
use std::process::Command;

use nestrad_tests::reference;
use serde_json::Value;

/// Stages that a row of the table has, in the order of the work.
const STAGES: [&str; 5] = ["direct light", "exchange", "far field", "solve", "results"];

/// A solve to be timed.
struct Case {
    name: String,
    arguments: Vec<String>,
}

/// Processor seconds of each stage, of all but input, and peak memory in MiB.
#[derive(Clone)]
struct Run {
    stages_s: Vec<f64>,
    total_s: f64,
    memory_MiB: f64,
}

fn main() {
    let runs: usize = std::env::args()
        .nth(1)
        .map_or(5, |n| n.parse().expect("expected a number of runs"));
    let folder = tempfile::tempdir().unwrap();
    let cases = cases(folder.path());
    let mut figures: Vec<Vec<Run>> = vec![Vec::new(); cases.len()];
    // in turn, so that a machine that drifts does so for all
    for _ in 0..runs {
        for (case, figures) in cases.iter().zip(&mut figures) {
            figures.push(run(case, &folder.path().join("out")));
        }
    }
    println!(
        "| scene, one thread | {} | all but input, CPU s | MiB |",
        STAGES.join(" | ")
    );
    println!("|---|{}---|---|", "---|".repeat(STAGES.len()));
    for (case, figures) in cases.iter().zip(&figures) {
        let of = |figure: &dyn Fn(&Run) -> f64| median(figures.iter().map(figure).collect());
        let stages: Vec<String> = (0..STAGES.len())
            .map(|k| format!("{:.2}", of(&|r| r.stages_s[k])))
            .collect();
        println!(
            "| {} | {} | {:.2} | {:.0} |",
            case.name,
            stages.join(" | "),
            of(&|r| r.total_s),
            of(&|r| r.memory_MiB)
        );
    }
    println!();
    for (case, figures) in cases.iter().zip(&figures) {
        let all: Vec<String> = figures
            .iter()
            .map(|r| format!("{:.2}", r.total_s))
            .collect();
        println!("{}: {} s", case.name, all.join(" "));
    }
}

fn cases(folder: &Path) -> Vec<Case> {
    let mut cases: Vec<Case> = [("maize of 8 plants", "4x2"), ("maize of 32 plants", "8x4")]
        .map(|(name, rows)| {
            let scene = folder.join(rows);
            let place = scene.display().to_string();
            nestrad(&["generate", "maize", "--rows", rows, "--out", &place]);
            Case {
                name: name.to_owned(),
                arguments: vec![format!("{place}/scene.toml")],
            }
        })
        .into();
    if let Some(shared) = reference::shared() {
        let scenes = shared.join("scenes").display().to_string();
        for (name, soil) in [("maize_rows", "-0.002"), ("bean_rows", "-0.010")] {
            let file = |name: &str| format!("{scenes}/{name}");
            let arguments = [
                file(&format!("{name}.can.gz")),
                format!("--optics=PAR={}", file("par.opt")),
                format!("--optics=NIR={}", file("nir.opt")),
                format!("--light={}", file("clear.light")),
                format!("--pattern={}", file(&format!("{name}.8"))),
                format!("--soil={soil}"),
            ];
            cases.push(Case {
                name: name.to_owned(),
                arguments: arguments.into(),
            });
        }
    }
    cases
}

fn run(case: &Case, out: &Path) -> Run {
    let place = out.display().to_string();
    let mut arguments = vec!["solve", "--quiet", "--threads", "1", "--out", &place];
    arguments.extend(case.arguments.iter().map(String::as_str));
    nestrad(&arguments);
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let summary: Value = serde_json::from_str(&summary).unwrap();
    let stages = summary["stages"].as_array().unwrap();
    let cpu_s = |name: &str| -> f64 {
        let stage = stages.iter().find(|s| s["name"] == name);
        stage.map_or(0.0, |s| s["cpu_s"].as_f64().unwrap())
    };
    Run {
        stages_s: STAGES.map(cpu_s).into(),
        total_s: stages
            .iter()
            .filter(|s| s["name"] != "input")
            .map(|s| s["cpu_s"].as_f64().unwrap())
            .sum(),
        memory_MiB: summary["resources"]["peak_memory_bytes"].as_f64().unwrap() / (1 << 20) as f64,
    }
}

/// Runs the program that was built beside this one.
fn nestrad(arguments: &[&str]) {
    let program: PathBuf = std::env::current_exe().unwrap().with_file_name("nestrad");
    let status = Command::new(&program).args(arguments).output();
    let output = status.unwrap_or_else(|e| panic!("{}: {e}", program.display()));
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}
