//! Clients that take much, or promise much, beside others.

use std::time::{Duration, Instant};

use nestrad_engine::plan::Settings;
use nestrad_proto::channel::{Credentials, connect};
use nestrad_proto::{RETRY_AFTER, v1};
use nestrad_service::client::{self, Client};
use nestrad_tests::calls::{block_on, client, ended, fetch, one_leaf, start, upload};
use nestrad_tests::desk::Desk;
use nestrad_tests::processes::{Master, nestrad, said, until, wait_for};
use tonic::{Code, Status};
use v1::scene_header::Geometry;
use v1::scene_slice::Part;

/// A client that shows a token of its own: on an open master that makes it another client.
fn stranger(desk: &Desk, master: &Master) -> Client {
    let path = desk.path("other-token");
    std::fs::write(&path, "another-client-altogether").unwrap();
    let credentials = Credentials {
        token_file: Some(path),
        ..Credentials::default()
    };
    client::client(connect(&master.url(), &credentials).unwrap())
}

async fn try_to_start(client: &mut Client, scene_id: &str) -> Result<String, Status> {
    let request = v1::StartSolveRequest {
        scene_id: scene_id.to_owned(),
        options: None,
        sensors: None,
    };
    let started = client.start_solve(request).await?;
    Ok(started.into_inner().solve_id)
}

/// Seconds after which a refused call is to be tried again.
fn retry_after_s(status: &Status) -> u64 {
    assert_eq!(status.code(), Code::ResourceExhausted, "{status}");
    let seconds = status.metadata().get(RETRY_AFTER).unwrap();
    let seconds: u64 = seconds.to_str().unwrap().parse().unwrap();
    let told = format!("try again in {seconds} s");
    assert!(status.message().contains(&told), "{status}");
    seconds
}

/// A solve that keeps the master busy for minutes; it runs when this returns, and its client as long as that lives.
fn busy(desk: &Desk, master: &Master) -> tokio::runtime::Runtime {
    desk.maize("maize", "1");
    let scene = desk.scene("maize/scene.toml");
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .enable_all()
        .build()
        .unwrap();
    let settings = Settings {
        accuracy_percent: 0.1,
        memory_GiB: 2.0,
        ..Settings::default()
    };
    let _entered = runtime.enter();
    let client = client(master);
    runtime.spawn(async move {
        let stop = std::future::pending();
        client::solve(client, scene, &settings, |_| {}, stop).await
    });
    until("it runs", || {
        master.metric("nestrad_solves{state=\"running\"}") == 1.0
    });
    runtime
}

#[test]
fn cancelled_solves_push_out_no_results() {
    let (desk, master) = (Desk::new(), Master::start(&[]));
    let (scene, first) = block_on(async {
        let mut client = client(&master);
        let scene = upload(&mut client, one_leaf()).await.unwrap().scene_id;
        let first = start(&mut client, &scene, v1::SolveOptions::default()).await;
        let last = ended(&mut client, &first).await;
        assert_eq!(last.state(), v1::SolveState::Finished);
        (scene, first)
    });
    let _busy = busy(&desk, &master);
    block_on(async {
        let mut client = client(&master);
        for _ in 0..300 {
            let solve_id = try_to_start(&mut client, &scene).await.unwrap();
            let request = v1::CancelSolveRequest { solve_id };
            let cancelled = client.cancel_solve(request).await.unwrap().into_inner();
            assert_eq!(cancelled.state(), v1::SolveState::Cancelled);
        }
        fetch(&mut client, &first).await.unwrap();
    });
    // they are not kept for ever
    assert!(master.metric("nestrad_solves{state=\"ended\"}") <= 257.0);
}

#[test]
fn three_hundred_quick_solves_are_all_fetched_afterwards() {
    let master = Master::start(&[]);
    block_on(async {
        let mut client = client(&master);
        let scene = upload(&mut client, one_leaf()).await.unwrap().scene_id;
        let mut solves = Vec::new();
        for _ in 0..300 {
            solves.push(try_to_start(&mut client, &scene).await.unwrap());
        }
        for id in &solves {
            let last = ended(&mut client, id).await;
            assert_eq!(last.state(), v1::SolveState::Finished);
        }
        for id in &solves {
            fetch(&mut client, id).await.unwrap();
        }
    });
}

#[test]
fn a_header_alone_drives_out_no_scene() {
    let master = Master::start(&["--scene-memory", "0.0001"]);
    block_on(async {
        let mut client = client(&master);
        let mut scenes = Vec::new();
        for height in 0..20 {
            let mut slices = one_leaf();
            if let Some(Part::Triangles(slice)) = &mut slices[2].part {
                slice.vertices_m[2] = 1.0 + f64::from(height);
            }
            scenes.push(upload(&mut client, slices).await.unwrap().scene_id);
        }
        // announced: nearly all that the master has room for
        let [mut header, ..] = one_leaf();
        if let Some(Part::Header(header)) = &mut header.part
            && let Some(Geometry::NewGeometry(new)) = &mut header.geometry
        {
            new.triangles = 1000;
        }
        let mut hostile = Vec::new();
        for _ in 0..4 {
            let (sender, receiver) = tokio::sync::mpsc::channel(1);
            sender.send(header.clone()).await.unwrap();
            let slices = tokio_stream::wrappers::ReceiverStream::new(receiver);
            let mut other = client.clone();
            let call = tokio::spawn(async move { other.upload_scene(slices).await });
            hostile.push((sender, call));
        }
        tokio::time::sleep(Duration::from_millis(200)).await;
        let again = upload(&mut client, one_leaf()).await.unwrap().scene_id;
        scenes.push(again);
        for scene in &scenes {
            let id = try_to_start(&mut client, scene).await.unwrap();
            ended(&mut client, &id).await;
            fetch(&mut client, &id).await.unwrap();
        }
        for (_, call) in hostile {
            assert!(!call.is_finished());
            call.abort();
        }
    });
}

#[test]
fn slices_without_content_do_not_block_uploads() {
    let master = Master::start(&[]);
    block_on(async {
        let mut client = client(&master);
        let [header, ..] = one_leaf();
        for _ in 0..12 {
            let (sender, receiver) = tokio::sync::mpsc::channel(1);
            let slices = tokio_stream::wrappers::ReceiverStream::new(receiver);
            let (mut other, header) = (client.clone(), header.clone());
            tokio::spawn(async move { other.upload_scene(slices).await });
            tokio::spawn(async move {
                let mut next = header;
                while sender.send(next).await.is_ok() {
                    let nothing = v1::TriangleSlice::default();
                    next = v1::SceneSlice {
                        part: Some(Part::Triangles(nothing)),
                    };
                    tokio::time::sleep(Duration::from_millis(100)).await;
                }
            });
        }
        // places become free after 10 s without content
        let begun = Instant::now();
        tokio::time::sleep(Duration::from_millis(200)).await;
        let scene = upload(&mut client, one_leaf()).await.unwrap();
        assert!(!scene.scene_id.is_empty());
        assert!(begun.elapsed() < Duration::from_secs(40));
    });
}

/// Room for the results of about nine small solves, of which one client may have half.
const FEW_RESULTS: [&str; 2] = ["--result-memory", "0.00004"];

#[test]
fn whoever_does_not_fetch_is_told_when_to_try_again() {
    let (desk, master) = (Desk::new(), Master::start(&FEW_RESULTS));
    block_on(async {
        let mut client = client(&master);
        let scene = upload(&mut client, one_leaf()).await.unwrap().scene_id;
        let mut solves = Vec::new();
        let refused = loop {
            match try_to_start(&mut client, &scene).await {
                Ok(id) => solves.push(id),
                Err(status) => break status,
            }
        };
        assert!((2..9).contains(&solves.len()), "{}", solves.len());
        assert!(retry_after_s(&refused) <= 60);
        assert!(refused.message().contains("results that are not fetched"));
        // another client is not hurt by that
        let mut other = stranger(&desk, &master);
        let id = try_to_start(&mut other, &scene).await.unwrap();
        assert_eq!(
            ended(&mut other, &id).await.state(),
            v1::SolveState::Finished
        );
        fetch(&mut other, &id).await.unwrap();
        // all of them are still there, and one that is fetched makes room
        for id in &solves {
            assert_eq!(
                ended(&mut client, id).await.state(),
                v1::SolveState::Finished
            );
        }
        fetch(&mut client, &solves[0]).await.unwrap();
        try_to_start(&mut client, &scene).await.unwrap();
        for id in &solves[1..] {
            fetch(&mut client, id).await.unwrap();
        }
    });
}

#[test]
fn a_client_waits_for_a_master_without_room() {
    let (desk, master) = (Desk::new(), Master::start(&["--queue", "1"]));
    let _busy = busy(&desk, &master);
    block_on(async {
        let mut client = client(&master);
        let scene = upload(&mut client, one_leaf()).await.unwrap().scene_id;
        try_to_start(&mut client, &scene).await.unwrap();
        let refused = try_to_start(&mut client, &scene).await.unwrap_err();
        retry_after_s(&refused);
    });
    let url = master.url();
    let args = ["solve", "scene.toml", "--out", "there", "--master", &url];
    let child = nestrad(desk.folder(), &args).spawn().unwrap();
    // its scene is there, and no solve of it
    until("it waits", || master.metric("nestrad_scenes") >= 3.0);
    std::thread::sleep(Duration::from_millis(500));
    block_on(async {
        let mut client = client(&master);
        let list = v1::ListSolvesRequest {};
        let solves = client.list_solves(list).await.unwrap().into_inner().solves;
        assert_eq!(solves.len(), 2);
        for solve in solves {
            let request = v1::CancelSolveRequest {
                solve_id: solve.solve_id,
            };
            client.cancel_solve(request).await.unwrap();
        }
    });
    let output = wait_for(child);
    assert!(output.status.success(), "{}", said(&output));
    assert!(
        said(&output).contains("the master has no room"),
        "{}",
        said(&output)
    );
    desk.done(&["solve", "scene.toml", "--out", "here"]);
    assert!(desk.tables("here") == desk.tables("there"));
}

#[test]
fn a_long_queue_of_one_client_does_not_keep_others_waiting() {
    let (desk, master) = (Desk::new(), Master::start(&["--queue", "8"]));
    let _busy = busy(&desk, &master);
    block_on(async {
        let mut client = client(&master);
        let scene = upload(&mut client, one_leaf()).await.unwrap().scene_id;
        let mut own = Vec::new();
        let refused = loop {
            match try_to_start(&mut client, &scene).await {
                Ok(id) => own.push(id),
                Err(status) => break status,
            }
        };
        retry_after_s(&refused);
        assert_eq!(own.len(), 4);
        let mut other = stranger(&desk, &master);
        let id = try_to_start(&mut other, &scene).await.unwrap();
        for (client, id, expected) in [
            (&mut other, &id, 1),
            // the one that runs, those before it, and the other client's, whose turn it is
            (&mut client, &own[3], 5),
        ] {
            let request = v1::WatchSolveRequest {
                solve_id: id.clone(),
            };
            let mut progress = client.watch_solve(request).await.unwrap().into_inner();
            let now = progress.message().await.unwrap().unwrap();
            assert_eq!(now.ahead, expected);
        }
    });
}
