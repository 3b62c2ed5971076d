//! Every option is explained.

use super::desk::Desk;

const SCENE: [&str; 13] = [
    "<SCENE>",
    "--optics <NAME=FILE>",
    "--light <FILE|NAME=FILE>",
    "--sky <SKY>",
    "--irradiance <NAME=W_m2>",
    "--time <UTC>",
    "--latitude <DEGREES>",
    "--longitude <DEGREES>",
    "--diffuse-fraction <PART>",
    "--pattern <FILE>",
    "--soil <Z>",
    "--unit <UNIT>",
    "--up <AXIS>",
];

const SOLVE: [&str; 13] = [
    "--diameter <auto|inf|METRES>",
    "--accuracy <PERCENT>",
    "--memory <GIB>",
    "--threads <N>",
    "--seed <N>",
    "--estimator <HOW>",
    "--scatter <all|none>",
    "--out <DIR>",
    "--format <FORM>",
    "--vtp",
    "--quiet",
    "uniform-overcast",
    "standard-overcast",
];

const TRADE: [&str; 7] = [
    "--out <DIR>",
    "--seeds <N>",
    "--finest <PERCENT>",
    "--memory <GIB>",
    "--threads <N>",
    "--seed <N>",
    "--quiet",
];

const SERVE: [&str; 17] = [
    "--audit <FRACTION>",
    "--listen <ADDRESS:PORT>",
    "--tls-cert <FILE>",
    "--tls-key <FILE>",
    "--client-ca <FILE>",
    "--client-token <FILE>",
    "--worker-token <FILE>",
    "--allow-plaintext",
    "--threads <N>",
    "--solves <N>",
    "--queue <N>",
    "--memory <GIB>",
    "--scene-memory <GIB>",
    "--result-memory <GIB>",
    "--drain <SECONDS>",
    "--metrics <ADDRESS:PORT>",
    "SIGTERM",
];

const MASTER: [&str; 5] = [
    "--master <URL>",
    "--ca <FILE>",
    "--cert <FILE>",
    "--key <FILE>",
    "--token-file <FILE>",
];

const PLANTS: [&str; 6] = [
    "--rows <ROWSxPLANTS>",
    "--row-spacing <METRES>",
    "--plant-spacing <METRES>",
    "--leaf-triangle <M2>",
    "--seed <N>",
    "--out <DIR>",
];

const RANDOM: [&str; 8] = [
    "--lai <LAI>",
    "--angles <NAME>",
    "--leaf-area <M2>",
    "--shape <SHAPE>",
    "--size <XxY>",
    "--height <METRES>",
    "--seed <N>",
    "--out <DIR>",
];

#[test]
fn help_mentions_every_option() {
    let desk = Desk::new();
    let solve = [&SCENE[..], &SOLVE, &MASTER].concat();
    let trade = [&SCENE[..], &TRADE].concat();
    for (command, options) in [
        (&["solve"][..], &solve[..]),
        (&["check"], &SCENE),
        (&["trade"], &trade),
        (&["serve"], &SERVE),
        (&["status"], &MASTER),
        (&["generate", "maize"], &PLANTS),
        (&["generate", "bean"], &PLANTS),
        (&["generate", "random"], &RANDOM),
    ] {
        let help = desk.done(&[command, &["--help"]].concat()).stdout;
        for option in options {
            assert!(help.contains(option), "{command:?} {option}: {help}");
        }
    }
}

#[test]
fn the_program_lists_its_commands_and_says_its_version() {
    let desk = Desk::new();
    let help = desk.done(&["--help"]).stdout;
    for command in ["solve", "check", "generate", "serve", "status", "trade"] {
        assert!(help.contains(&format!("  {command} ")), "{help}");
    }
    let version = desk.done(&["--version"]).stdout;
    assert_eq!(version, format!("nestrad {}\n", env!("CARGO_PKG_VERSION")));
}

#[test]
fn calls_that_make_no_sense_are_refused_with_code_2() {
    let desk = Desk::new();
    let solve = |more: &[&'static str]| [&["solve", "scene.toml"], more].concat();
    let out = ["--out", "out"];
    let sky = |more: &[&'static str]| solve(&[&out[..], &["--sky"], more].concat());
    for (args, said) in [
        (vec![], "Usage"),
        (vec!["solv"], "solv"),
        (solve(&[]), "--out"),
        (
            solve(&["--out", "out", "--diameter", "0"]),
            "metres above 0",
        ),
        (solve(&["--out", "out", "--accuracy", "-1"]), "above 0"),
        (solve(&["--out", "out", "--accuracy", "nan"]), "above 0"),
        (solve(&["--out", "out", "--unit", "inch"]), "m, cm or mm"),
        (solve(&["--out", "out", "--optics", "par.opt"]), "NAME=FILE"),
        (solve(&["--out", "out", "b.toml"]), "one scene file"),
        (
            solve(&["--out", "out", "--light", "a", "--light", "PAR=b"]),
            "NAME=FILE for each band",
        ),
        (
            solve(&["--out", "out", "--light", "A=a", "--light", "A=b"]),
            "given twice",
        ),
        (sky(&["clear", "--irradiance", "PAR=1"]), "--time"),
        (sky(&["uniform-overcast"]), "--irradiance"),
        (
            sky(&[
                "uniform-overcast",
                "--irradiance",
                "PAR=1",
                "--latitude",
                "-3",
            ]),
            "are for skies with a sun",
        ),
        (
            sky(&["uniform-overcast", "--irradiance", "PAR=much"]),
            "expected a number",
        ),
        (
            vec!["generate", "maize", "--rows", "4", "--out", "demo"],
            "two numbers",
        ),
        (
            vec!["generate", "random", "--angles", "flat", "--out", "demo"],
            "spherical",
        ),
    ] {
        let ran = desk.run(&args);
        assert_eq!(ran.code, Some(2), "{args:?}: {}", ran.stderr);
        assert!(ran.stderr.contains(said), "{args:?}: {}", ran.stderr);
    }
    assert!(!desk.path("out").exists() && !desk.path("demo").exists());
}
