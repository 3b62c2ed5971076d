//! A zero has no sign, wherever it is written.

use std::fs;

use super::desk::{Desk, files};

/// Words that are a negative zero, and where.
fn minus_zeros(text: &str) -> Vec<&str> {
    let word = |c: char| !(c.is_ascii_digit() || matches!(c, '-' | '+' | '.' | 'e' | 'E'));
    text.split(word)
        .filter(|word| word.starts_with('-') && word.parse().is_ok_and(|x: f64| x == 0.0))
        .collect()
}

/// Soil triangles alone, soil just below 0, a corner at -0, light from straight above: sums of nothing
/// are -0 in Rust, and so is a negative number that is rounded away.
#[test]
fn minus_zero_was_printed_by_check_and_written_by_solve() {
    let desk = Desk::new();
    desk.put("soil.can", "p 1 0 3 -0.0 -0 0 1 0 0 0 1 -1e-9\n");
    desk.put("dark.opt", "n 1\ns d 0\ne d 0 d 0 0 d 0 0\n");
    desk.put("above.light", "100 -0.0 0 -1\n");
    let scene = [
        "soil.can",
        "--optics",
        "PAR=dark.opt",
        "--light",
        "above.light",
        "--soil",
        "-0.0004",
    ];
    let checked = desk.done(&[&["check"], &scene[..]].concat()).stdout;
    assert!(checked.contains("a plane at z = 0.000 m"), "{checked}");
    assert!(minus_zeros(&checked).is_empty(), "{checked}");

    let solve = [&["solve", "--out", "out", "--vtp"], &scene[..]].concat();
    let solved = desk.done(&solve);
    for said in [&solved.stdout, &solved.stderr] {
        assert!(minus_zeros(said).is_empty(), "{said}");
    }
    for (name, content) in files(&desk.path("out")) {
        if !name.ends_with(".vtp") {
            let text = String::from_utf8(content).unwrap();
            assert!(minus_zeros(&text).is_empty(), "{name}: {text}");
        }
    }
    desk.done(&["report", "out"]);
    let page = fs::read_to_string(desk.path("out/report.html")).unwrap();
    let facts = page.split("id=\"report\">").nth(1).unwrap();
    let facts = facts.split("</script>").next().unwrap();
    assert!(minus_zeros(facts).is_empty(), "{facts}");
}

#[test]
fn what_is_a_minus_zero() {
    assert_eq!(
        minus_zeros("-0.00 -0.01 [-0] 1e-05 \"-0.0\""),
        ["-0.00", "-0", "-0.0"]
    );
}
