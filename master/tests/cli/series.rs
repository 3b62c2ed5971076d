//! `nestrad series` and `nestrad day`.

use std::fs;
use std::path::PathBuf;
use std::thread::sleep;
use std::time::Duration;

use super::desk::{Desk, Ran, files};

const SCENE: &str = "\
scene = \"plants.can\"
pattern = \"ground.8\"
soil = -0.01
[light.band_fraction]
PAR = 0.45
NIR = 0.5
[[bands]]
name = \"PAR\"
optics = \"par.opt\"
photon_umol_J = 4.57
[[bands]]
name = \"NIR\"
optics = \"nir.opt\"
";

/// A night, a morning and a noon.
const WEATHER: &str = "\
time,ghi_W_m2,dhi_W_m2,note
2026-06-21T03:00Z,0,0,night
2026-06-21T05:00Z,40,35,
2026-06-21T07:00Z,300,110,
2026-06-21T09:00Z,650,140,
2026-06-21T11:00Z,850,150,noon
";

const PLACE: [&str; 4] = ["--latitude", "43.6", "--longitude", "3.9"];

fn desk() -> Desk {
    let desk = Desk::new();
    desk.put("season.toml", SCENE);
    desk.put("weather.csv", WEATHER);
    desk
}

fn series(more: &[&'static str]) -> Vec<&'static str> {
    let all = ["series", "season.toml", "--weather", "weather.csv"];
    [&all[..], &PLACE, &["--accuracy", "3", "--out", "out"], more].concat()
}

/// Rows of a table by the names of their columns.
fn rows(desk: &Desk, name: &str) -> Vec<Vec<(String, String)>> {
    let text = desk.text(name);
    let mut lines = text.lines();
    let head: Vec<String> = lines.next().unwrap().split(',').map(Into::into).collect();
    lines
        .map(|line| {
            let cells = line.split(',').map(Into::into);
            head.iter().cloned().zip(cells).collect()
        })
        .collect()
}

fn cell<'a>(row: &'a [(String, String)], name: &str) -> &'a str {
    &row.iter().find(|(column, _)| column == name).unwrap().1
}

fn number(row: &[(String, String)], name: &str) -> f64 {
    cell(row, name).parse().unwrap()
}

#[test]
fn every_row_of_the_weather_is_a_light_and_sums_are_those_of_the_rows() {
    let desk = desk();
    let ran = desk.done(&series(&["--sky", "perez"]));
    assert!(ran.stderr.contains("not used: note"), "{}", ran.stderr);
    let series = rows(&desk, "out/series.csv");
    let integrals = rows(&desk, "out/integrals.csv");
    // 3 organs, 2 bands, 5 moments
    assert_eq!((series.len(), integrals.len()), (30, 6));
    for row in &series[..6] {
        assert_eq!(cell(row, "time"), "2026-06-21T03:00Z");
        assert_eq!(number(row, "absorbed_W"), 0.0);
    }
    assert!(
        series[6..]
            .iter()
            .all(|row| number(row, "absorbed_W") > 0.0)
    );
    for (item, sum) in integrals.iter().enumerate() {
        // the first and the last row stand for an hour, the others for two
        let weights = [3600.0, 7200.0, 7200.0, 7200.0, 3600.0];
        let of = |name: &str| -> f64 {
            let steps = weights.iter().enumerate();
            steps
                .map(|(step, weight)| weight * number(&series[6 * step + item], name))
                .sum()
        };
        for (watts, joules) in [
            ("absorbed_W", "absorbed_J"),
            ("absorbed_direct_W", "absorbed_direct_J"),
            ("absorbed_se_W", "absorbed_se_J"),
        ] {
            let found = number(sum, joules);
            assert!((found / of(watts) - 1.0).abs() < 1e-7, "{joules}: {found}");
        }
        if cell(sum, "band") == "PAR" {
            let mol = 4.57e-6 * number(sum, "absorbed_J");
            assert!((number(sum, "absorbed_mol") / mol - 1.0).abs() < 1e-7);
        } else {
            assert_eq!(cell(sum, "absorbed_mol"), "");
        }
    }
    // what plants absorb is what their organs absorb, and what comes in is what was measured
    let total = |rows: &[Vec<(String, String)>]| -> f64 {
        rows.iter().map(|row| number(row, "absorbed_W")).sum()
    };
    for name in ["out/plants.csv", "out/species.csv"] {
        let groups = rows(&desk, name);
        assert!(
            (total(&groups) / total(&series) - 1.0).abs() < 1e-7,
            "{name}"
        );
    }
    let balance = rows(&desk, "out/balance.csv");
    assert_eq!(balance.len(), 10);
    for (row, ghi) in balance.chunks(2).zip([0.0, 40.0, 300.0, 650.0, 850.0]) {
        assert!((number(&row[0], "incoming_W") - 0.45 * ghi).abs() < 1e-6 * ghi.max(1.0));
        assert!((number(&row[1], "incoming_W") - 0.5 * ghi).abs() < 1e-6 * ghi.max(1.0));
    }
    let summary: serde_json::Value = serde_json::from_str(&desk.text("out/summary.json")).unwrap();
    assert_eq!(summary["lit_moments"], 4);
    assert_eq!(summary["bands"][0]["photon_umol_J"], 4.57);
    assert_eq!(summary["plan"]["chosen_by"], "2026-06-21T11:00Z");
    // nothing stays beside the result
    assert!(part(&desk).is_none());
}

/// All files of a folder but the summary, which says what it took.
fn tables(desk: &Desk, folder: &str) -> Vec<(String, Vec<u8>)> {
    let all = files(&desk.path(folder)).into_iter();
    all.filter(|(name, _)| name.ends_with(".csv")).collect()
}

fn part(desk: &Desk) -> Option<PathBuf> {
    let entries = fs::read_dir(desk.path(".")).unwrap();
    let mut paths = entries.map(|entry| entry.unwrap().path());
    paths.find(|path| path.to_string_lossy().contains("out.series-"))
}

#[test]
fn a_series_that_was_killed_goes_on_and_ends_with_the_same_bytes() {
    let desk = desk();
    let whole = [
        "day",
        "season.toml",
        "--date",
        "2026-06-21",
        "--every",
        "5min",
        "--sky",
        "clear",
    ];
    let day = |out: &'static str| [&whole[..], &PLACE, &["--accuracy", "2", "--out", out]].concat();
    desk.done(&day("whole"));
    // killed twice, at other places
    let mut before = 0;
    for _ in 0..2 {
        let mut child = desk.command(&day("out")).spawn().unwrap();
        loop {
            let bytes = part(&desk).and_then(|path| Some(fs::metadata(path).ok()?.len()));
            if bytes.is_some_and(|bytes| bytes > before + 10_000) {
                break;
            }
            assert!(
                child.try_wait().unwrap().is_none(),
                "it was done before it was killed"
            );
            sleep(Duration::from_millis(1));
        }
        // SIGKILL
        child.kill().unwrap();
        child.wait().unwrap();
        before = fs::metadata(part(&desk).unwrap()).unwrap().len();
        assert!(!desk.path("out/summary.json").exists());
    }
    let ran = desk.done(&day("out"));
    assert!(
        ran.stderr.contains("are done already: going on"),
        "{}",
        ran.stderr
    );
    assert!(part(&desk).is_none());
    let (found, expected) = (tables(&desk, "out"), tables(&desk, "whole"));
    assert_eq!(expected.len(), 5);
    assert!(found == expected, "resumed tables differ");
}

#[test]
fn what_cannot_be_is_named_and_nothing_is_written() {
    let desk = desk();
    let refused = |weather: &str, more: &[&'static str]| -> Ran {
        desk.put("weather.csv", weather);
        let ran = desk.run(&series(more));
        assert!(!desk.path("out").exists() && part(&desk).is_none());
        ran
    };
    let uniform = ["--sky", "uniform-overcast"];
    for (weather, more, code, expected) in [
        (
            "time,ghi,dhi\n2026-06-21T11:00Z,5,6\n2026-06-21T12:00Z,1,1\n",
            &uniform[..],
            1,
            "weather.csv, line 2: expected DHI of at most GHI",
        ),
        (
            "time,ghi,dhi\n2026-06-21T22:00Z,5,4\n2026-06-21T23:00Z,1,1\n",
            &uniform,
            1,
            "weather.csv, line 2: expected no direct light",
        ),
        (
            "time,ghi,dhi\n2026-06-21T22:00Z,0,0\n2026-06-21T23:00Z,0,0\n",
            &uniform,
            2,
            "there is no light at any moment",
        ),
        (
            WEATHER,
            &["--sky", "cie-16"],
            2,
            "expected perez, cie-1 to cie-15",
        ),
        (
            WEATHER,
            &["--sky", "perez", "--band-fraction", "PAR=0.4"],
            1,
            "band NIR: expected columns direct_NIR_W_m2",
        ),
        (
            WEATHER,
            &["--sky", "perez", "--band-fraction", "PAR=1.4"],
            1,
            "band fraction of PAR: expected above 0 to 1",
        ),
        (WEATHER, &["--sky", "perez", "--latitude", "91"], 2, ""),
    ] {
        let ran = refused(weather, more);
        assert_eq!(ran.code, Some(code), "{}", ran.stderr);
        assert!(ran.stderr.contains(expected), "{}", ran.stderr);
    }
}

#[test]
fn series_and_solve_do_not_share_a_folder() {
    let desk = desk();
    desk.done(&["solve", "scene.toml", "--accuracy", "3", "--out", "out"]);
    desk.done(&series(&["--sky", "cie-3", "--format", "parquet"]));
    let names: Vec<String> = files(&desk.path("out"))
        .into_iter()
        .map(|(name, _)| name)
        .collect();
    let expected = [
        "balance.parquet",
        "integrals.parquet",
        "plants.parquet",
        "series.parquet",
        "species.parquet",
        "summary.json",
    ];
    assert_eq!(names, expected);
    desk.done(&["solve", "scene.toml", "--accuracy", "3", "--out", "out"]);
    assert!(!desk.path("out/series.parquet").exists());
}
