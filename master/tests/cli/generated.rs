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

#[test]
fn files_of_the_user_were_overwritten() {
    let desk = Desk::new();
    let rows = ["--rows", "1x1", "--leaf-triangle", "1e-3", "--out", "demo"];
    let generate = |more: &[&str]| desk.run(&[&["generate", "maize"], &rows[..], more].concat());
    assert_eq!(generate(&[]).code, Some(0));
    // another canopy over one that nobody has touched, and back
    assert_eq!(generate(&["--seed", "2"]).code, Some(0));
    assert_eq!(generate(&[]).code, Some(0));
    let before = files(&desk.path("demo"));

    desk.put("demo/par.opt", desk.text("demo/par.opt") + "# mine\n");
    let changed = files(&desk.path("demo"));
    for seed in ["1", "2"] {
        let ran = generate(&["--seed", seed]);
        assert_eq!(ran.code, Some(1));
        let wanted = "demo/par.opt: was not made by nestrad generate, or was changed since; expected --force";
        assert!(ran.stderr.contains(wanted), "{}", ran.stderr);
        assert!(files(&desk.path("demo")) == changed);
    }
    assert_eq!(generate(&["--force"]).code, Some(0));
    assert!(files(&desk.path("demo")) == before);

    // a file of the same name in a folder of one's own
    let ran = desk.run(&["generate", "maize", "--out", "."]);
    assert_eq!(ran.code, Some(1));
    assert!(ran.stderr.contains("par.opt"), "{}", ran.stderr);
    assert!(!desk.path("maize.can").exists());
}
