//! `nestrad report`: the page holds the numbers of the tables, and a browser shows them.

#![allow(clippy::unwrap_used, reason = "what cannot be set up fails the test")]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use nestrad_tests::processes::{finish, nestrad, said, wait_for};
use serde_json::Value;
use tempfile::TempDir;

/// A small bean canopy, solved. The folder has `scene.toml` and `out`.
fn solved(format: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for args in [
        "generate bean --rows 1x2 --leaf-triangle 1e-4 --out .".to_owned(),
        format!("solve scene.toml --out out --accuracy 5 --quiet --format {format}"),
    ] {
        let args: Vec<&str> = args.split(' ').collect();
        let output = finish(nestrad(folder.path(), &args));
        assert!(output.status.success(), "{}", said(&output));
    }
    folder
}

/// Runs `nestrad report` and returns what it said, and whether it succeeded.
fn report(folder: &Path, args: &[&str]) -> (String, bool) {
    let args = [&["report", "out"], args].concat();
    let output = finish(nestrad(folder, &args));
    (said(&output), output.status.success())
}

fn page(folder: &Path) -> String {
    fs::read_to_string(folder.join("out/report.html")).unwrap()
}

/// The text of an element that is known by its id.
fn element<'a>(page: &'a str, id: &str) -> &'a str {
    let (_, after) = page.split_once(&format!("id=\"{id}\"")).unwrap();
    let (_, text) = after.split_once('>').unwrap();
    text.split_once("</").unwrap().0
}

fn facts(page: &str) -> Value {
    serde_json::from_str(element(page, "report")).unwrap()
}

/// The last organ of the table, and its absorbed power in each band.
fn last_organ(folder: &Path) -> (String, Vec<f64>) {
    let table = fs::read_to_string(folder.join("out/organs.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|row| row.split(',').collect()).collect();
    let column = |name: &str| rows[0].iter().position(|column| *column == name).unwrap();
    let (organ, absorbed) = (column("organ"), column("absorbed_W"));
    let last = rows.last().unwrap()[organ];
    let own = rows.iter().filter(|row| row[organ] == last);
    (
        last.to_owned(),
        own.map(|row| row[absorbed].parse().unwrap()).collect(),
    )
}

#[test]
fn the_page_has_the_numbers_of_the_tables() {
    let folder = solved("csv");
    let (said, good) = report(folder.path(), &[]);
    assert!(good && said.contains("report.html"), "{said}");
    let page = page(folder.path());
    let facts = facts(&page);

    let (name, absorbed) = last_organ(folder.path());
    let organ = facts["organs"].as_array().unwrap().last().unwrap();
    assert_eq!(organ["organ"], name);
    for (band, expected) in absorbed.iter().enumerate() {
        assert_eq!(organ["light"][band]["absorbed_W"], *expected);
    }

    for (band, balance) in facts["balance"].as_array().unwrap().iter().enumerate() {
        let layers = facts["layers"].as_array().unwrap().iter();
        let sum: f64 = layers
            .map(|l| l["absorbed_W"][band].as_f64().unwrap())
            .sum();
        let total = balance["absorbed_plants_W"]["value"].as_f64().unwrap();
        assert!((sum - total).abs() < 1e-7 * total, "{sum} of {total}");
    }
    for outside in ["http://", "https://", "src="] {
        assert!(!page.contains(outside), "{outside}");
    }

    let (said, good) = report(folder.path(), &["--png", "pic.png", "--png-band", "UV"]);
    assert!(!good && said.contains("PAR, NIR"), "{said}");
    let (said, good) = report(folder.path(), &["--png", "pic.png", "--png-band", "NIR"]);
    assert!(good, "{said}");
    let picture = fs::read(folder.path().join("pic.png")).unwrap();
    assert!(picture.starts_with(b"\x89PNG") && picture.len() > 20_000);
    // nothing is left beside it
    let left = fs::read_dir(folder.path().join("out")).unwrap();
    let hidden = left.filter(|f| {
        f.as_ref()
            .unwrap()
            .file_name()
            .to_string_lossy()
            .starts_with('.')
    });
    assert_eq!(hidden.count(), 0);
}

#[test]
fn a_canopy_that_is_too_large_is_not_drawn() {
    let folder = solved("csv");
    let (said, good) = report(folder.path(), &["--most-triangles", "10"]);
    assert!(good && said.contains("not drawn"), "{said}");
    let page = page(folder.path());
    assert!(!page.contains("id=\"vertices\""));
    assert!(facts(&page)["not_drawn"].is_string());
}

#[test]
fn what_cannot_be_reported_is_said() {
    let folder = solved("csv");
    let at = |name: &str| folder.path().join(name);

    // another canopy
    fs::rename(at("bean.can"), at("moved.can")).unwrap();
    let (said, good) = report(folder.path(), &[]);
    assert!(
        !good && said.contains("bean.can") && said.contains("--scene"),
        "{said}"
    );
    let (said, good) = report(folder.path(), &["--scene", "moved.can"]);
    assert!(good, "{said}");
    let text = fs::read_to_string(at("moved.can")).unwrap();
    fs::write(
        at("bean.can"),
        text + "p 1 100001001001 3 0 0 1 1 0 1 0 1 1\n",
    )
    .unwrap();
    let (said, good) = report(folder.path(), &[]);
    assert!(!good && said.contains("triangles"), "{said}");

    // no result
    fs::remove_file(at("out/summary.json")).unwrap();
    let (said, good) = report(folder.path(), &[]);
    assert!(!good && said.contains("summary.json"), "{said}");
}

#[test]
fn parquet_was_refused() {
    let folders = ["csv", "parquet"].map(|format| {
        let folder = solved(format);
        let (said, good) = report(folder.path(), &["-q"]);
        assert!(good && said.is_empty(), "{said}");
        folder
    });
    let [of_csv, of_parquet] = folders.map(|folder| {
        let page = page(folder.path());
        let mut facts = facts(&page);
        // seconds differ from run to run
        facts["resources"] = Value::Null;
        (facts, element(&page, "absorbed-1").to_owned())
    });
    assert!(of_csv.0["organs"].as_array().unwrap().len() > 2);
    assert!(of_csv == of_parquet);
}

#[test]
fn a_report_was_made_only_where_solve_had_run() {
    let folder = solved("csv");
    let elsewhere = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let report = |more: &[&str]| {
        let args = [&["report", out.to_str().unwrap()], more].concat();
        let output = finish(nestrad(elsewhere.path(), &args));
        (said(&output), output.status.success())
    };
    let (said, good) = report(&[]);
    assert!(good, "{said}");
    let page = page(folder.path());
    assert_eq!(facts(&page)["title"], "bean.can");

    // moved: the message says where it was, the flag where it is, seen from here
    fs::rename(
        folder.path().join("bean.can"),
        elsewhere.path().join("moved.can"),
    )
    .unwrap();
    let (said, good) = report(&[]);
    let path = folder.path().join("bean.can");
    assert!(
        !good && said.contains(path.to_str().unwrap()) && said.contains("--scene"),
        "{said}"
    );
    let (said, good) = report(&["--scene", "moved.can"]);
    assert!(good, "{said}");
}

/// Half a square metre of leaf over a box of 2 m by 1 m.
#[test]
fn the_ground_of_an_open_scene_was_not_said() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    put(
        "two.can",
        "p 1 100001001001 4 0 0 1 0.5 0 1 0.5 0.5 1 0 0.5 1\n\
         p 1 100002001001 4 1.5 0.5 1.2 2 0.5 1.2 2 1 1.2 1.5 1 1.2\n",
    );
    put("par.opt", "n 1\ns d 0.2\ne d 0.1 d 0.1 0.1 d 0.1 0.1\n");
    put("sun.light", "100 0 0 -1\n");
    let solve = "solve two.can --optics PAR=par.opt --light sun.light --soil 0 --out out --quiet";
    let args: Vec<&str> = solve.split(' ').collect();
    let output = finish(nestrad(folder.path(), &args));
    assert!(output.status.success(), "{}", said(&output));
    let (said, good) = report(folder.path(), &[]);
    assert!(good, "{said}");
    let facts = facts(&page(folder.path()));
    assert_eq!(facts["ground_m"], serde_json::json!([2.0, 1.0]));
    assert_eq!(facts["area_index"], 0.25);
    // all of it is in full light, which is that of a square metre, not of a ground of another size
    let layers = facts["layers"].as_array().unwrap();
    let lit = layers
        .iter()
        .map(|l| l["by_direct_m2"][0][39].as_f64().unwrap());
    assert!((lit.sum::<f64>() - 0.5).abs() < 1e-9, "{layers:?}");

    if let Some(chromium) = chromium() {
        let seen = seen(&chromium, folder.path(), 0);
        let facts = seen["facts"].as_str().unwrap();
        let said = "per area of the box around the scene, 2.00 m x 1.00 m";
        assert!(facts.contains(said), "{facts}");
    }
}

fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&path)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|program| program.is_file())
}

/// What the page says of itself in a browser, having drawn and having clicked an organ.
fn seen(chromium: &Path, folder: &Path, organ: usize) -> Value {
    let url = format!(
        "file://{}#selftest={organ}",
        folder.join("out/report.html").display()
    );
    let mut command = Command::new(chromium);
    command
        .args(["--headless", "--no-sandbox", "--disable-dev-shm-usage"])
        .args(["--use-gl=angle", "--use-angle=swiftshader"])
        .args(["--enable-unsafe-swiftshader", "--window-size=1000,900"])
        .arg(format!(
            "--user-data-dir={}",
            folder.join("browser").display()
        ))
        .args(["--virtual-time-budget=20000", "--dump-dom", &url])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let output = wait_for(command.spawn().unwrap());
    let dom = String::from_utf8_lossy(&output.stdout).into_owned();
    let outcome = element(&dom, "selftest");
    serde_json::from_str(outcome).unwrap_or_else(|error| {
        panic!(
            "{error} in {outcome:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        )
    })
}

#[test]
fn a_browser_draws_it_and_picks_an_organ() {
    let Some(chromium) = chromium() else {
        // libtest shows it with --nocapture only: it goes past it
        use std::io::Write;
        let line = "\nSKIPPED: the report in a browser is not tested, no chromium on PATH\n";
        std::io::stderr().write_all(line.as_bytes()).unwrap();
        return;
    };
    let folder = solved("csv");
    let (said, good) = report(folder.path(), &[]);
    assert!(good, "{said}");
    let facts = facts(&page(folder.path()));
    let organs = facts["organs"].as_array().unwrap();
    // a leaf in full light, which is seen from above
    let bright = |k: &usize| organs[*k]["light"][0]["direct_W"].as_f64().unwrap();
    let organ = (0..organs.len())
        .max_by(|a, b| bright(a).total_cmp(&bright(b)))
        .unwrap();

    let seen = seen(&chromium, folder.path(), organ);
    assert!(seen["error"].is_null(), "{seen}");
    assert_eq!(seen["gl_error"], 0, "{seen}");
    let (drawn, pixels) = (
        seen["drawn"].as_u64().unwrap(),
        seen["pixels"].as_u64().unwrap(),
    );
    assert!(drawn > pixels / 50 && drawn < pixels, "{seen}");
    assert!(seen["colours"].as_u64().unwrap() > 50, "{seen}");
    assert_eq!(seen["picked"], organ, "{seen}");
    let panel = seen["panel"].as_str().unwrap();
    let name = organs[organ]["organ"].as_str().unwrap();
    assert!(panel.contains(&format!("organ {name}")), "{panel}");
    // a name is not cut, and a number has its unit
    assert!(panel.contains("PAR") && panel.contains(" W m⁻²"), "{panel}");
    assert_eq!(seen["order"][0], "Energy balance", "{seen}");
    assert_eq!(seen["minus_zeros"], Value::Array(Vec::new()), "{seen}");
    assert_eq!(seen["wide"], false, "{seen}");

    // shade can be told apart: the darker half of all triangles takes more of the ramp than on a linear scale
    let ramp = |name: &str| -> Vec<f64> {
        let places = seen["ramps"][name]["places"].as_array().unwrap();
        places.iter().map(|place| place.as_f64().unwrap()).collect()
    };
    for by in ["triangle", "organ"] {
        let [log, linear, equal] =
            ["log", "linear", "quantiles"].map(|how| ramp(&format!("{by} {how}")));
        assert!(log[2] - log[0] > linear[2] - linear[0], "{by}: {seen}");
        assert!(equal[4] - equal[0] > 0.6 && equal[2] > 0.25, "{by}: {seen}");
    }
    // organs have a scale of their own
    let ticks = |name: &str| seen["ramps"][name]["ticks"].as_str().unwrap().to_owned();
    assert!(ticks("triangle log") != ticks("organ log").replace(", mean of an organ", ""));

    // as many digits as the standard error leaves
    let light = &organs[organ]["light"][0];
    let (value, se) = (
        light["absorbed_W"].as_f64().unwrap(),
        light["se_W"].as_f64().unwrap(),
    );
    let decimals = (1.0 - se.log10().floor()).max(0.0) as usize;
    let shown = format!("{value:.decimals$} ± {se:.decimals$}");
    assert!(panel.contains(&shown), "{shown} in {panel}");
}
