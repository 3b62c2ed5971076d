//! What a solve writes.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::desk::{Desk, Ran, SOLVE, SOLVE_BY_FLAGS, files};

const TABLES: [&str; 3] = ["organs.csv", "triangles.csv", "soil.csv"];

fn with(more: &[&'static str]) -> Vec<&'static str> {
    [&SOLVE[..], more].concat()
}

/// The tables after a run.
fn tables(desk: &Desk, args: &[&str]) -> [String; 3] {
    desk.done(args);
    TABLES.map(|name| desk.text(&format!("out/{name}")))
}

fn names(desk: &Desk) -> Vec<String> {
    files(&desk.path("out"))
        .into_iter()
        .map(|(name, _)| name)
        .collect()
}

#[test]
fn tables_are_complete_and_finite() {
    let desk = Desk::new();
    let [organs, triangles, soil] = tables(&desk, &SOLVE);
    assert_eq!(
        names(&desk),
        ["organs.csv", "soil.csv", "summary.json", "triangles.csv"]
    );
    let bands = 2;
    for (table, head, rows) in [
        (
            &organs,
            "species,plant,organ,kind,area_m2,band,irradiance_upper_W_m2,irradiance_lower_W_m2,absorbed_W,absorbed_direct_W,absorbed_se_W,absorbed_bias_W,sunlit_area_m2,shaded_area_m2,sunlit_area_se_m2",
            3 * bands,
        ),
        (
            &triangles,
            "triangle,species,plant,organ,kind,area_m2,band,irradiance_upper_W_m2,irradiance_lower_W_m2,absorbed_W_m2,absorbed_direct_W_m2,absorbed_se_W_m2",
            4 * bands,
        ),
        (
            &soil,
            "ix,iy,x_m,y_m,cell_x_m,cell_y_m,band,irradiance_W_m2,irradiance_se_W_m2",
            soil.lines().count() - 1,
        ),
    ] {
        let mut lines = table.lines();
        assert_eq!(lines.next(), Some(head));
        let lines: Vec<&str> = lines.collect();
        assert_eq!(lines.len(), rows);
        assert!(table.ends_with('\n') && rows > 0 && rows % bands == 0);
        for line in lines {
            let cells: Vec<&str> = line.split(',').collect();
            assert_eq!(cells.len(), head.split(',').count(), "{line}");
            for (cell, name) in cells.iter().zip(head.split(',')) {
                let number = cell.parse::<f64>();
                let text = ["band", "plant", "organ", "kind"].contains(&name);
                assert!(text || number.is_ok_and(f64::is_finite), "{name}: {line}");
            }
        }
    }
    let ids: Vec<&str> = organs
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').nth(2))
        .collect();
    assert_eq!(ids, ["1000", "1000", "1001", "1001", "2001", "2001"]);
}

#[test]
fn the_summary_has_its_sections_and_the_balance_closes() {
    let desk = Desk::new();
    let stdout = desk.done(&SOLVE).stdout;
    let summary: Value = serde_json::from_str(&desk.text("out/summary.json")).unwrap();
    for section in [
        "version",
        "options",
        "scene",
        "plan",
        "energy_balance",
        "error_estimates",
        "counters",
        "stages",
        "resources",
    ] {
        assert!(!summary[section].is_null(), "{section}");
    }
    assert_eq!(summary["options"]["accuracy_percent"], 0.5);
    // found from any folder
    let scene = summary["options"]["scenes"][0].as_str().unwrap();
    assert_eq!(Path::new(scene), desk.path("plants.can"));
    assert_eq!(summary["scene"]["triangles"], 4);
    for (band, name) in ["PAR", "NIR"].iter().enumerate() {
        let balance = &summary["energy_balance"][band];
        assert_eq!(balance["band"], *name);
        let value = |key: &str| balance[key]["value"].as_f64().unwrap();
        let incoming = balance["incoming_W"].as_f64().unwrap();
        assert!((incoming - 500.0).abs() < 1e-6);
        assert!(value("closure_W").abs() < 0.01 * incoming);
        assert!(value("absorbed_plants_W") > 0.0 && value("absorbed_soil_W") > 0.0);
        assert!(stdout.contains(name), "{stdout}");
    }
}

#[test]
fn flags_say_the_same_as_a_scene_file() {
    let (by_file, by_flags) = (Desk::new(), Desk::new());
    assert!(tables(&by_file, &SOLVE) == tables(&by_flags, &SOLVE_BY_FLAGS));
}

#[test]
fn flags_win_over_a_scene_file() {
    let desk = Desk::new();
    let [_, _, soil] = tables(&desk, &with(&["--optics", "RED=par.opt"]));
    assert!(soil.contains(",RED,") && !soil.contains(",PAR,"));
}

#[test]
fn threads_change_nothing_and_seeds_do() {
    let desk = Desk::new();
    let one = tables(&desk, &with(&["--threads", "1"]));
    assert!(one == tables(&desk, &with(&["--threads", "2"])));
    assert!(one != tables(&desk, &with(&["--threads", "2", "--seed", "2"])));
}

#[test]
fn the_unit_of_length_changes_nothing() {
    let desk = Desk::new();
    let metres = tables(&desk, &SOLVE);
    let in_millimetres = |text: String| -> String {
        let word = |word: &str| match word.parse::<f64>() {
            // labels and counts have no decimal point; all coordinates but 0 and 1 have one
            Ok(value) if word.contains('.') => format!("{}", (value * 1000.0).round()),
            _ => word.to_owned(),
        };
        let line = |line: &str| line.split(' ').map(word).collect::<Vec<_>>().join(" ");
        text.lines().map(line).collect::<Vec<_>>().join("\n")
    };
    desk.put("plants.can", in_millimetres(desk.text("plants.can")));
    desk.put("ground.8", "0 0\n1000 1000\n");
    let more = ["--unit", "mm", "--soil", "-10"];
    assert!(metres == tables(&desk, &with(&more)));
}

#[test]
fn other_forms_take_the_place_of_the_first() {
    let desk = Desk::new();
    desk.done(&SOLVE);
    desk.done(&with(&["--format", "parquet", "--vtp"]));
    let expected = [
        "canopy.vtp",
        "organs.parquet",
        "soil.parquet",
        "summary.json",
        "triangles.parquet",
    ];
    assert_eq!(names(&desk), expected);
    for (name, content) in files(&desk.path("out")) {
        if name.ends_with(".parquet") {
            assert!(
                content.starts_with(b"PAR1") && content.ends_with(b"PAR1"),
                "{name}"
            );
        }
    }
    let surface = std::fs::read(desk.path("out/canopy.vtp")).unwrap();
    assert!(surface.starts_with(b"<?xml") && surface.ends_with(b"</VTKFile>\n"));
}

#[test]
fn quiet_says_nothing() {
    let desk = Desk::new();
    let ran = desk.done(&with(&["--quiet"]));
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
}

#[test]
fn a_plant_alone_under_a_sky() {
    let desk = Desk::new();
    let ran = desk.done(&[
        "solve",
        "plants.can",
        "--optics",
        "PAR=par.opt",
        "--sky",
        "standard-overcast",
        "--irradiance",
        "PAR=300",
        "--accuracy",
        "2",
        "--out",
        "out",
    ]);
    assert!(ran.stdout.contains("whole scene"), "{}", ran.stdout);
    assert_eq!(
        names(&desk),
        ["organs.csv", "summary.json", "triangles.csv"]
    );
    let summary: Value = serde_json::from_str(&desk.text("out/summary.json")).unwrap();
    assert_eq!(summary["options"]["sources"], 200);
}

#[test]
fn the_independent_estimator_agrees() {
    let desk = Desk::new();
    let absorbed = |how: &'static str| -> Vec<f64> {
        desk.done(&with(&["--estimator", how]));
        let text = desk.text("out/summary.json");
        let summary: Value = serde_json::from_str(&text).unwrap();
        let band = |b: usize| &summary["energy_balance"][b]["absorbed_plants_W"]["value"];
        (0..2).map(|b| band(b).as_f64().unwrap()).collect()
    };
    let (lines, rays) = (absorbed("lines"), absorbed("rays"));
    for (line, ray) in lines.iter().zip(&rays) {
        assert!((line / ray - 1.0).abs() < 0.01, "{lines:?} {rays:?}");
    }
}

#[test]
fn a_disk_that_is_full_under_the_results_is_a_limit() {
    let desk = Desk::new();
    for format in ["csv", "parquet"] {
        let mut command = Command::new("bash");
        // no file can be written, as on a full disk; pipes can
        let full = "trap '' XFSZ; ulimit -f 0; exec \"$0\" \"$@\"";
        let nestrad = desk.command(&[]);
        command
            .args(["-c", full])
            .arg(nestrad.get_program())
            .args(with(&["--format", format]))
            .current_dir(desk.path(""));
        let ran = Ran::from(command.output().unwrap());
        assert_eq!(ran.code, Some(4), "{format}: {}", ran.stderr);
        assert!(ran.stderr.contains("cannot write out/"), "{}", ran.stderr);
    }
}
