//! What is generated can be solved, with no other data at hand.

use super::desk::{Desk, files};

/// Generates (few, large triangles), checks and solves.
fn generates_and_solves(canopy: &str, more: &[&str]) {
    let desk = Desk::new();
    let generate = |out: &'static str| [&["generate", canopy, "--out", out], more].concat();
    let said = desk.done(&generate("demo")).stdout;
    let command = "solve it: nestrad solve demo/scene.toml --out demo/out";
    assert!(said.contains(command), "{said}");

    desk.done(&generate("again"));
    assert!(files(&desk.path("demo")) == files(&desk.path("again")));

    let checked = desk.done(&["check", "demo/scene.toml"]).stdout;
    assert!(!checked.contains("warning"), "{checked}");

    desk.done(&[
        "solve",
        "demo/scene.toml",
        "--accuracy",
        "5",
        "--out",
        "demo/out",
    ]);
    let organs = desk.text("demo/out/organs.csv");
    let bands = ["PAR", "NIR"].map(|band| organs.matches(&format!(",{band},")).count());
    assert!(bands[0] > 0 && bands[0] == bands[1], "{bands:?}");
}

#[test]
fn maize() {
    let more = [
        "--rows",
        "1x2",
        "--leaf-triangle",
        "1e-3",
        "--row-spacing",
        "0.6",
    ];
    generates_and_solves("maize", &more);
}

#[test]
fn bean() {
    let more = [
        "--rows",
        "2x1",
        "--leaf-triangle",
        "1e-3",
        "--plant-spacing",
        "0.2",
    ];
    generates_and_solves("bean", &more);
}

#[test]
fn random_leaves() {
    let more = [
        "--lai",
        "2",
        "--angles",
        "ellipsoidal:2",
        "--leaf-area",
        "1e-3",
        "--size",
        "0.5x0.6",
        "--height",
        "0.4",
        "--shape",
        "disc",
        "--seed",
        "7",
    ];
    generates_and_solves("random", &more);
}

#[test]
fn what_no_canopy_can_be_made_from_is_refused() {
    let desk = Desk::new();
    for (args, said) in [
        (["generate", "random", "--lai=-1"], "leaf area index is -1"),
        (["generate", "random", "--height=0.001"], "height in m"),
        (["generate", "maize", "--rows=0x3"], "number of plants"),
        (["generate", "bean", "--row-spacing=nan"], "row spacing"),
    ] {
        let ran = desk.run(&[&args[..], &["--out", "demo"]].concat());
        assert_eq!(ran.code, Some(1), "{}", ran.stderr);
        assert!(ran.stderr.contains(said), "{}", ran.stderr);
    }
    assert!(!desk.path("demo").exists());
}
