//! Sensors of a scene file: the same numbers here and at a master, and what is said of them.

#![allow(clippy::unwrap_used)]

use std::fs;

use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, said};

const SENSORS: &str = r#"
[[sensors]]
name = "post"
points = [[0.4, 0.3, 0.5], [0.4, 0.3, 0.1]]
sides = "both"
radiance_from = [[1, 0, 0], [0, -1, 0.2]]
rays = 512
[[sensors]]
name = "floor"
grid = { corners = [0, 0, 1, 1], cells = [2, 2], heights = [0, 0.3] }
rays = 512
[[sensors]]
name = "bud"
spheres = [[0.5, 0.5, 0.2]]
[[sensors]]
name = "leaf"
patch = [[0, 0, 0.2], [0.2, 0, 0.2], [0, 0.2, 0.3]]
"#;

fn desk() -> Desk {
    let desk = Desk::new();
    let text = fs::read_to_string(desk.path("scene.toml")).unwrap();
    fs::write(desk.path("sensors.toml"), text + SENSORS).unwrap();
    desk
}

#[test]
fn a_master_reads_the_same_sensors() {
    let (desk, master) = (desk(), Master::start(&[]));
    for more in [&[][..], &["--scatter", "none"], &["--diameter", "0.3"]] {
        desk.compare("sensors.toml", more, &master);
        for table in ["sensors.csv", "radiance.csv"] {
            let [here, there] = ["here", "there"]
                .map(|out| fs::read_to_string(desk.path(out).join(table)).unwrap());
            assert!(here == there, "{table} {more:?}");
            // a header; points, sides, cells, spheres, patches; bands
            let rows = if table == "sensors.csv" {
                4 + 8 + 1 + 1
            } else {
                4
            };
            assert_eq!(here.lines().count(), 1 + 2 * rows, "{here}");
        }
    }
    // organs know nothing of them
    desk.done(&[
        "solve",
        "scene.toml",
        "--out",
        "without",
        "--diameter",
        "0.3",
    ]);
    assert!(desk.tables("without") == desk.tables("here"));
    assert!(!desk.path("without/sensors.csv").exists());
    // a folder shows one result
    desk.done(&[
        "solve",
        "sensors.toml",
        "--out",
        "here",
        "--format",
        "parquet",
    ]);
    assert!(desk.path("here/sensors.parquet").exists());
    assert!(!desk.path("here/sensors.csv").exists());
}

#[test]
fn a_check_lists_them_and_refuses_what_lies_under_the_soil() {
    let desk = desk();
    let listed = desk.done(&["check", "sensors.toml"]).stdout;
    let text = String::from_utf8_lossy(&listed);
    for line in [
        "post: 8 readings (upper, lower, radiance) at x 0.400, y 0.300, z 0.100 to 0.500 m, 512 rays each",
        "floor: 8 readings (upper) at x 0.000 to 1.000, y 0.000 to 1.000, z 0.000 to 0.300 m",
        "bud: 1 readings (sphere)",
    ] {
        assert!(text.contains(line), "{line}: {text}");
    }
    let under = fs::read_to_string(desk.path("sensors.toml")).unwrap();
    let under = under.replace("[[0.5, 0.5, 0.2]]", "[[0.5, 0.5, -0.2]]");
    fs::write(desk.path("under.toml"), under).unwrap();
    for command in [
        &["check", "under.toml"][..],
        &["solve", "under.toml", "--out", "out"],
    ] {
        let output = desk.run(command);
        assert_eq!(output.status.code(), Some(1));
        let text = said(&output);
        let expected = "sensor 'bud': expected a place that is not under the soil at -0.01 m, found z = -0.2 m";
        assert!(text.contains(expected), "{text}");
    }
}
