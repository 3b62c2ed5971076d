//! What a master computes is what is computed here.

use std::sync::Arc;

use nestrad_engine::plan::Settings;
use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client, ended, one_leaf, solve, start, upload};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, nestrad, said, wait_for};
use nestrad_tests::solving;

#[test]
fn a_master_gives_the_bytes_of_the_command_line() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    desk.compare("scene.toml", &[], &master);
    desk.maize("maize", "1");
    for more in [
        &["--accuracy", "3"][..],
        &["--accuracy", "3", "--diameter", "0.4", "--seed", "7"],
        &["--accuracy", "5", "--estimator", "rays"],
        &[
            "--accuracy",
            "8",
            "--sky",
            "standard-overcast",
            "--irradiance",
            "PAR=300",
            "--irradiance",
            "NIR=280",
        ],
    ] {
        desk.compare("maize/scene.toml", more, &master);
    }
}

#[test]
fn a_scene_that_stands_alone_gives_the_same_bytes() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    let text = "o plant\ng blade\nusemtl leaf\nv 3 4 5\nv 3.2 4 5\nv 3 4.3 5.1\nf 1 2 3\n";
    std::fs::write(desk.path("leaf.obj"), text).unwrap();
    let scene = "scene = \"leaf.obj\"\nsoil = 4.5\nlight = \"day.light\"\n[[bands]]\nname = \"PAR\"\n\
                 soil_albedo = 0.2\n[bands.materials]\nleaf = { rho = 0.1, tau = 0.05 }\n";
    std::fs::write(desk.path("alone.toml"), scene).unwrap();
    desk.compare("alone.toml", &[], &master);
}

#[test]
fn species_and_kinds_travel_with_the_scene() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    let face = |x: f64, z: f64, material: &str| {
        format!("v {x} 0.1 {z}\nv {x}5 0.1 {z}\nv {x} 0.9 {z}\nusemtl {material}\nf -3 -2 -1\n")
    };
    let tree = face(0.1, 0.4, "leaf") + &face(0.2, 0.3, "bark");
    let house = face(0.4, 0.9, "panel") + &face(0.6, 0.0, "earth");
    std::fs::write(desk.path("oak.obj"), &tree).unwrap();
    std::fs::write(desk.path("house.obj"), tree + &house).unwrap();
    let green = "leaf = { rho = 0.1, tau = 0.05 }\nbark = { rho = 0.3, tau = 0.1 }\n\
                 panel = { rho = 0.1, tau = 0.7 }\nearth = { rho = 0.2 }\n";
    let scene = desk.path("scene.toml");
    let text = std::fs::read_to_string(&scene).unwrap();
    let text =
        text.replace(
            "\"plants.can\"",
            "[\"plants.can\", \"oak.obj\", \"house.obj\"]",
        )
        .replace(
            "par.opt\"\n",
            &format!("par.opt\"\n[bands.materials]\n{green}"),
        )
        .replace(
            "nir.opt\"\n",
            &format!("nir.opt\"\n[bands.materials]\n{green}"),
        ) + "[kinds]\nmaterials = { bark = \"stem\", panel = \"structure\", earth = \"soil\" }\n";
    std::fs::write(&scene, text).unwrap();
    desk.compare("scene.toml", &[], &master);
    let [here, there] = ["here", "there"].map(|out| {
        let text = std::fs::read_to_string(desk.path(out).join("summary.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap()
    });
    for section in ["energy_balance", "error_estimates", "scene"] {
        assert_eq!(here[section], there[section], "{section}");
    }
    let table = std::fs::read_to_string(desk.path("there/organs.csv")).unwrap();
    for row in [
        "\n1,1,1000,stem,",
        "\noak,default,default,mixed,",
        "\nhouse,",
    ] {
        assert!(table.contains(row), "{row}: {table}");
    }
}

#[test]
fn the_summary_has_what_the_master_says() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    let output = desk.done(&[
        "solve",
        "scene.toml",
        "--out",
        "there",
        "--master",
        &master.url(),
    ]);
    let text = std::fs::read_to_string(desk.path("there/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    desk.done(&["solve", "scene.toml", "--out", "here"]);
    let text = std::fs::read_to_string(desk.path("here/summary.json")).unwrap();
    let here: serde_json::Value = serde_json::from_str(&text).unwrap();
    for section in [
        "plan",
        "energy_balance",
        "error_estimates",
        "counters",
        "scene",
    ] {
        assert_eq!(summary[section], here[section], "{section}");
    }
    assert_eq!(summary["options"]["master"], master.url());
    assert!(summary["stages"].to_string().contains("master: exchange"));
    assert!(said(&output).contains("plan: exchange"));
}

#[test]
fn two_clients_at_once_get_each_their_own() {
    let (desk, master) = (Desk::new(), Master::start(&["--solves", "2"]));
    for (name, seed) in [("one", "1"), ("two", "2")] {
        desk.maize(name, seed);
        let scene = format!("{name}/scene.toml");
        let out = format!("{name}/here");
        desk.done(&["solve", &scene, "--accuracy", "3", "--out", &out]);
    }
    let url = master.url();
    let running = ["one", "two", "one", "two"].map(|name| {
        let (scene, out) = (format!("{name}/scene.toml"), format!("{name}/there"));
        let args = [
            "solve",
            &scene,
            "--accuracy",
            "3",
            "--out",
            &out,
            "--master",
            &url,
        ];
        nestrad(desk.folder(), &args).spawn().unwrap()
    });
    for child in running {
        let output = wait_for(child);
        assert!(output.status.success(), "{}", said(&output));
    }
    for name in ["one", "two"] {
        let tables = |out: &str| desk.tables(&format!("{name}/{out}"));
        assert!(tables("here") == tables("there"), "{name}");
    }
    assert!(desk.tables("one/here") != desk.tables("two/here"));
}

#[test]
fn another_sun_needs_no_second_upload_of_the_geometry() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    let scene = desk.scene("scene.toml");
    block_on(async {
        let mut client = client(&master);
        let first = upload(&mut client, one_leaf()).await.unwrap();
        let [mut header, ..] = one_leaf();
        if let Some(v1::scene_slice::Part::Header(header)) = &mut header.part {
            let known = v1::scene_header::Geometry::GeometryId(first.geometry_id.clone());
            header.geometry = Some(known);
            header.sources[0].irradiance_w_m2 = vec![50.0];
        }
        let second = upload(&mut client, [header]).await.unwrap();
        assert_eq!(first.geometry_id, second.geometry_id);
        assert_ne!(first.scene_id, second.scene_id);
        for (uploaded, absorbed_W) in [(first, 50.0), (second, 25.0)] {
            let id = start(&mut client, &uploaded.scene_id, v1::SolveOptions::default()).await;
            assert_eq!(
                ended(&mut client, &id).await.state(),
                v1::SolveState::Finished
            );
            let request = v1::FetchResultsRequest {
                solve_id: id,
                table: v1::ResultTable::Organs.into(),
            };
            let mut slices = client.fetch_results(request).await.unwrap().into_inner();
            let slice = slices.message().await.unwrap().unwrap();
            let Some(v1::result_slice::Part::Organs(organs)) = slice.part else {
                panic!("organs")
            };
            assert_eq!(
                (organs.id[0].as_str(), organs.bands[0].as_str()),
                ("blade", "PAR")
            );
            let absorbed = organs.light.unwrap().absorbed_w[0];
            assert!((absorbed / absorbed_W - 1.0).abs() < 0.01, "{absorbed}");
            assert!(slices.message().await.unwrap().is_none());
        }
        // and the library's client agrees with the library
        let settings = Settings::default();
        let there = solve(client, scene.clone(), &settings).await;
        assert_eq!(there.solution, solving::solve(&scene, &settings).solution);
        let held = (
            Arc::strong_count(&scene.canopy),
            Arc::strong_count(&scene.optics),
            Arc::strong_count(&scene.light),
        );
        assert_eq!(held, (1, 1, 1));
    });
}
