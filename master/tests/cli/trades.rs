//! Speed against accuracy.

use super::desk::{Desk, files};

const TRADE: [&str; 8] = [
    "trade",
    "scene.toml",
    "--finest",
    "2",
    "--seeds",
    "2",
    "--out",
    "out",
];

#[test]
fn a_study_is_written_and_not_computed_again() {
    let desk = Desk::new();
    let first = desk.done(&TRADE);
    assert!(first.stdout.contains("--accuracy "), "{}", first.stdout);
    assert!(first.stderr.contains(" left\n"), "{}", first.stderr);
    let before = files(&desk.path("out"));
    let names: Vec<&str> = before.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["trade.csv", "trade.html", "trade.jsonl"]);
    let table = desk.text("out/trade.csv");
    assert!(table.contains(",PAR,") && table.contains(",NIR,"));
    let page = desk.text("out/trade.html");
    assert!(page.contains("plants.can") && page.ends_with("</html>\n"));

    let again = desk.done(&TRADE);
    assert!(again.stderr.contains("0 runs"), "{}", again.stderr);
    assert_eq!(again.stdout, first.stdout);
    assert!(files(&desk.path("out")) == before);

    let quiet = desk.done(&[&TRADE[..], &["--quiet"]].concat());
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
}

#[test]
fn one_seed_is_refused() {
    let desk = Desk::new();
    let ran = desk.run(&["trade", "scene.toml", "--out", "out", "--seeds", "1"]);
    assert_eq!(ran.code, Some(2), "{}", ran.stderr);
    assert!(!desk.path("out").exists());
}
