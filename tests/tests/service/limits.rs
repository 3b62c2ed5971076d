//! What a master does not take on.

use nestrad_proto::v1;
use nestrad_tests::calls::{block_on, client, one_leaf, start, upload};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, said};
use tonic::Code;

#[test]
fn scenes_are_bounded_before_they_arrive_and_old_ones_go_first() {
    let master = Master::start(&["--scene-memory", "0.0001"]);
    block_on(async {
        let mut client = client(&master);
        let [mut header, ..] = one_leaf();
        if let Some(v1::scene_slice::Part::Header(header)) = &mut header.part
            && let Some(v1::scene_header::Geometry::NewGeometry(new)) = &mut header.geometry
        {
            new.triangles = 1 << 20;
        }
        let status = upload(&mut client, [header]).await.unwrap_err();
        assert_eq!(status.code(), Code::ResourceExhausted);
        assert!(
            status.message().contains("107374 bytes of scenes"),
            "{status}"
        );

        // small ones drive each other out
        let mut first = None;
        for height in 0..200 {
            let mut slices = one_leaf();
            if let Some(v1::scene_slice::Part::Triangles(slice)) = &mut slices[2].part {
                slice.vertices_m[2] = 1.0 + f64::from(height);
            }
            let id = upload(&mut client, slices).await.unwrap().scene_id;
            first.get_or_insert(id);
        }
        let request = v1::StartSolveRequest {
            scene_id: first.unwrap(),
            options: None,
            sensors: None,
        };
        let status = client.start_solve(request).await.unwrap_err();
        assert_eq!(status.code(), Code::NotFound);
    });
    assert!(master.metric("nestrad_scene_bytes") <= 107_374.0);
    assert!(master.metric("nestrad_scenes") > 10.0);
}

#[test]
fn a_scene_that_is_too_large_is_refused_with_the_limit() {
    let (desk, master) = (Desk::new(), Master::start(&["--scene-memory", "0.0001"]));
    desk.maize("maize", "1");
    let url = master.url();
    let output = desk.run(&[
        "solve",
        "maize/scene.toml",
        "--out",
        "out",
        "--master",
        &url,
    ]);
    assert_eq!(output.status.code(), Some(4));
    assert!(said(&output).contains("107374 bytes"), "{}", said(&output));
    assert!(!desk.path("out").exists());
}

#[test]
fn memory_of_a_solve_and_the_queue_are_bounded() {
    let (desk, master) = (
        Desk::new(),
        Master::start(&["--memory", "2", "--queue", "1"]),
    );
    let url = master.url();
    let args = ["solve", "scene.toml", "--out", "out", "--master", &url];
    let output = desk.run(&args);
    assert!(
        said(&output).contains("at most 2, the limit of this master"),
        "{}",
        said(&output)
    );
    desk.done(&[&args[..], &["--memory", "2"]].concat());
    block_on(async {
        let mut client = client(&master);
        desk.maize("maize", "1");
        let scene = desk.scene("maize/scene.toml");
        // a solve that takes long, one that waits, and no more
        let settings = nestrad_engine::plan::Settings {
            accuracy_percent: 0.1,
            memory_GiB: 2.0,
            ..Default::default()
        };
        let other = client.clone();
        let long = tokio::spawn(async move {
            let stop = std::future::pending();
            nestrad_service::client::solve(other, scene, &settings, |_| {}, stop).await
        });
        let scene = upload(&mut client, one_leaf()).await.unwrap().scene_id;
        let list = v1::ListSolvesRequest {};
        loop {
            let solves = client.list_solves(list).await.unwrap().into_inner().solves;
            if solves.iter().any(|s| s.state() == v1::SolveState::Running) {
                break;
            }
            tokio::time::sleep(std::time::Duration::from_millis(10)).await;
        }
        start(&mut client, &scene, v1::SolveOptions::default()).await;
        let request = v1::StartSolveRequest {
            scene_id: scene,
            options: None,
            sensors: None,
        };
        let status = client.start_solve(request).await.unwrap_err();
        assert_eq!(status.code(), Code::ResourceExhausted);
        let expected = "1 solves wait already, 1 of them yours: the master holds 1 at most";
        assert!(status.message().starts_with(expected), "{status}");
        long.abort();
    });
}
